// SPDX-License-Identifier: Apache-2.0
#include "quaternion_pose.h"

#include "alidade/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::QuaternionPose, "quaternion_pose",
                              "a rigid body with constant velocities but for random accelerations",
                              "[MonoSlam2015] sec. 4.3, [Davison2007]"))
