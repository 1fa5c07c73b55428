// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/pose.h"
#include "sensors/pseudorange.h"
#include "sensors/range_bearing.h"
#include "sensors/relative_pose.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Composite, EveryModel,
    ::testing::Values(
        StaticSensorRow("pose",
                        "{sigma_position_m: 0.1, sigma_orientation_rad: [0.01, 0.02, 0.02]}",
                        Pose<3>({0.1, 0.1, 0.1}, {0.01, 0.02, 0.02}),
                        {kPosition, {0.6, 0.0, 0.8, 0.0}}),
        SensorRow("range_bearing",
                  "{sigma_range_m: 0.1, sigma_bearing_rad: 0.05, landmarks: {representation: xyz}}",
                  RangeBearing<Xyz>(0.1, 0.05), {kPosition, kOrientation, {0.2, 0.4, 2.0}}),
        SensorRow("relative_pose",
                  "{sigma_position_m: [0.1, 0.2, 0.3], sigma_orientation_rad: 0.01}",
                  RelativePose<3>({0.1, 0.2, 0.3}, {0.01, 0.01, 0.01}),
                  {kPosition, kOrientation, {0.2, 0.4, 2.0}, {0.6, 0.0, 0.8, 0.0}}),
        SensorRow("pose",
                  "{roles: {position: vector(2)}, sigma_position_m: 0.1, sigma_heading_rad: 0.02}",
                  Pose<2>({0.1, 0.1}, {0.02}), {{0.1, -0.1}, {0.5}}),
        SensorRow("relative_pose",
                  "{roles: {position: vector(2)}, sigma_position_m: [0.1, 0.2], "
                  "sigma_heading_rad: 0.01}",
                  RelativePose<2>({0.1, 0.2}, {0.01}), {{0.1, -0.1}, {0.5}, {2.0, 0.4}, {-0.3}}),
        StaticSensorRow("pseudorange", "{sigma_m: 0.5}", Pseudorange(0.5),
                        {{1.0, 2.0, 3.0}, {0.2}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
