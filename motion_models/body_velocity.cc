// SPDX-License-Identifier: Apache-2.0
#include "body_velocity.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::BodyVelocityMotion, "body_velocity",
                              "a rigid body with nearly constant velocities in its own frame",
                              "[Moore2014]; [Hartley2020]"))
