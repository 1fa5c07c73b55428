// SPDX-License-Identifier: Apache-2.0
#include "every_model_fixture.h"
#include "sensors/altitude.h"
#include "sensors/direct.h"
#include "sensors/speed.h"
#include "sensors/turn_rate.h"
#include "sensors/zero.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Elements, EveryModel,
    ::testing::Values(
        SensorRow("altitude", "{roles: {height: vector(1)}, sigma_m: 0.1}", Altitude<1, false>(0.1),
                  {{5.0}, {0.1}}),
        SensorRow("altitude", "{roles: {position: vector(3)}, measures: pressure, sigma_pa: 1}",
                  Altitude<3, true>(1.0), {{1.0, 2.0, 50.0}, {0.2}}),
        SensorRow("direct", "{roles: {value: vector(2)}, sigma: [0.1, 0.05]}",
                  Direct<Vec<2>>({0.1, 0.05}), {{1.0, 2.0}, {0.1, -0.1}}),
        SensorRow("direct", "{roles: {value: angle}, sigma: 0.1}", Direct<Angle>({0.1}),
                  {{3.1}, {0.1}}),
        SensorRow("direct", "{roles: {value: unit_quaternion}, sigma: 0.1}",
                  Direct<UnitQuaternion>({0.1, 0.1, 0.1}),
                  {{0.6, 0.0, 0.8, 0.0}, {0.1, -0.1, 0.0}}),
        SensorRow("direct", "{roles: {value: unit_vector}, sigma: 0.1}",
                  Direct<UnitVector>({0.1, 0.1}), {{0.6, 0.0, 0.8}, {0.1, -0.1}}),
        SensorRow("speed", "{roles: {velocity: vector(2)}, sigma_m_s: 0.1}", Speed<2>(0.1),
                  {{3.0, -4.0}, {0.01}, {0.1}}),
        SensorRow("turn_rate", "{sigma_rad_s: 0.05}", TurnRate<2>(0.05), {{0.5}, {0.02}, {0.01}}),
        SensorRow("turn_rate",
                  "{roles: {angular_velocity: vector(3)}, sigma_rad_s: [0.05, 0.06, 0.07]}",
                  TurnRate<3>({0.05, 0.06, 0.07}),
                  {{0.5, -0.2, 0.1}, {0.02, 0.0, -0.02}, {0.01, 0.0, 0.02}, {0.6, 0.0, 0.8, 0.0}}),
        SensorRow("zero", "{roles: {velocity: vector(2)}, sigma: 0.1}", ZeroVelocity<2>(0.1),
                  {{0.02, -0.01}})),
    RowName);

}  // namespace
}  // namespace alidade::testing
