// SPDX-License-Identifier: Apache-2.0
#include "planar_body_velocity.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::PlanarBodyVelocity, "planar_body_velocity",
                              "a body in the plane with nearly constant velocity in its own frame",
                              "[Moore2014]"))
