// SPDX-License-Identifier: Apache-2.0
#include "motion_models/odometry_pose.h"

#include "every_model_fixture.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    OdometryPose, EveryModel,
    ::testing::Values(StaticMotionRow(
        "odometry_pose", "{noise: {kind: discrete, linear_velocity: 0.3, angular_velocity: 0.002}}",
        OdometryPose(NoiseKind::kDiscrete, {0.3, 0.3, 0.3}, {0.002, 0.002, 0.002}),
        {{1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {1, 0, 0, 0}, {0.02}}, 0.05)),
    RowName);

}  // namespace
}  // namespace alidade::testing
