// SPDX-License-Identifier: Apache-2.0
#include "odometry_pose.h"

#include "alidade/model/plugin.h"

ALIDADE_PLUGIN(ALIDADE_MOTION(alidade::OdometryPose, "odometry_pose",
                              "a camera on a vehicle with measured velocities", ""))
