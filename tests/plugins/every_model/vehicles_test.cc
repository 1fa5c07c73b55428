// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "motion_models/bicycle.h"
#include "motion_models/coordinated_turn.h"
#include "motion_models/differential_drive.h"
#include "motion_models/planar_body_velocity.h"
#include "motion_models/unicycle.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Vehicles, EveryModel,
    ::testing::Values(
        MotionRow("coordinated_turn", "{noise: {acceleration: 0.05, angular_acceleration: 0.02}}",
                  CoordinatedTurn(0.05, 0.02), {{1.0, 2.0}, {0.5}, {0.05}, {0.1}}, 0.05),
        MotionRow("unicycle", "{noise: {kind: discrete, speed: 0.1, turn_rate: 0.05}}",
                  Unicycle(NoiseKind::kDiscrete, 0.1, 0.05), {{1.0, 2.0}, {0.5}}, 0.05),
        MotionRow("differential_drive",
                  "{noise: {wheel_speed: [0.1, 0.2]}, wheel_radius_m: 0.3, track_width_m: 0.5}",
                  DifferentialDrive(NoiseKind::kContinuous, {0.1, 0.2}, 0.3, 0.5),
                  {{1.0, 2.0}, {0.5}, {0.01}, {0.0}, {-0.01}}, 0.05),
        MotionRow("bicycle", "{noise: {speed: 0.1, steering_angle: 0.05}, wheelbase_m: 1.5}",
                  Bicycle(NoiseKind::kContinuous, 0.1, 0.05, 1.5), {{1.0, 2.0}, {0.5}}, 0.05),
        MotionRow("planar_body_velocity",
                  "{noise: {linear_acceleration: [0.1, 0.05], angular_acceleration: 0.05}}",
                  PlanarBodyVelocity({0.1, 0.05}, 0.05), {{1.0, 2.0}, {0.5}, {0.1, 0.0}, {0.1}},
                  0.05)),
    RowName);

}  // namespace
}  // namespace alidade::testing
