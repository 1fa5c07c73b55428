// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/heading.h"
#include "sensors/magnetometer.h"
#include "sensors/specific_force.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Attitudes, EveryModel,
    ::testing::Values(
        SensorRow("heading", "{roles: {heading: angle}, sigma_rad: 0.05, declination_rad: 0.1}",
                  HeadingOfAngle(0.05, 0.1), {{3.1}, {0.02}}),
        SensorRow("heading", "{roles: {orientation: unit_quaternion}, sigma_rad: 0.05}",
                  HeadingOfOrientation(0.05), {{0.6, 0.0, 0.0, 0.8}, {0.02}}),
        SensorRow("magnetometer", "{field_ut: [2, 22, -44], sigma_ut: [1, 2, 3]}",
                  Magnetometer({1.0, 2.0, 3.0}, {2.0, 22.0, -44.0}),
                  {{0.6, 0.0, 0.8, 0.0}, {1.0, -2.0, 0.5}, {0.8, 0.0, 0.0, 0.6}}),
        SensorRow("specific_force", "{sigma_m_s2: [0.2, 0.3, 0.2]}", SpecificForce({0.2, 0.3, 0.2}),
                  {{0.6, 0.0, 0.8, 0.0}, {0.1, 0.0, -0.1}, {0.8, 0.0, 0.0, 0.6}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
