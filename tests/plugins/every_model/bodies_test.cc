// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "motion_models/attitude.h"
#include "motion_models/body_velocity.h"
#include "motion_models/inertial.h"

namespace alidade::testing {
namespace {

const Means kInertial{
    {1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {0.01, 0.0, 0.0}, {0.0, 0.01, 0.0}};

INSTANTIATE_TEST_SUITE_P(
    Bodies, EveryModel,
    ::testing::Values(
        MotionRow("body_velocity",
                  "{noise: {linear_acceleration: 0.1, angular_acceleration: [0.05, 0.1, 0.15]}}",
                  BodyVelocityMotion({0.1, 0.1, 0.1}, {0.05, 0.1, 0.15}),
                  {{1.0, 2.0, 3.0}, {1, 0, 0, 0}, {0.1, 0.0, -0.1}, {0.1, -0.1, 0.0}}, 0.05),
        MotionRow("attitude", "{noise: {gyro: 0.05}}", Attitude({0.05, 0.05, 0.05}),
                  {{1, 0, 0, 0}, {0.02, 0.01, 0.0}}, 0.05),
        MotionRow("inertial",
                  "{gravity_m_s2: [0, 0, -0.1], noise: {gyro: 0.05, accelerometer: 0.1}}",
                  Inertial<>({0.05, 0.05, 0.05}, {0.1, 0.1, 0.1}, {0.0, 0.0, -0.1}), kInertial,
                  0.05),
        MotionRow("inertial",
                  "{integration: midpoint, gravity_m_s2: [0, 0, -0.1], "
                  "noise: {gyro: 0.05, accelerometer: 0.1}}",
                  Inertial<InertialIntegration::kMidpoint>({0.05, 0.05, 0.05}, {0.1, 0.1, 0.1},
                                                           {0.0, 0.0, -0.1}),
                  kInertial, 0.05)),
    RowName);

}  // namespace
}  // namespace alidade::testing
