// SPDX-License-Identifier: Apache-2.0
#include "motion_models/quaternion_pose.h"

#include "every_model_fixture.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    QuaternionPose, EveryModel,
    ::testing::Values(
        MotionRow("quaternion_pose",
                  "{noise: {kind: discrete, linear_acceleration: 0.4, angular_acceleration: [0.2, "
                  "0.3, 0.4]}}",
                  QuaternionPose({0.4, 0.4, 0.4}, {0.2, 0.3, 0.4}),
                  {{1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {0.1, -0.1, 0.0}}, 0.05),
        MotionRow("quaternion_pose",
                  "{noise: {linear_acceleration: 0.1, angular_acceleration: [0.05, 0.1, 0.15]}}",
                  ContinuousQuaternionPose({0.1, 0.1, 0.1}, {0.05, 0.1, 0.15}),
                  {{1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {0.1, -0.1, 0.0}}, 0.05)),
    RowName);

}  // namespace
}  // namespace alidade::testing
