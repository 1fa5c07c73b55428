// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/fixed_known.h"
#include "every_model_fixture.h"
#include "sensors/body_velocity.h"
#include "sensors/known_pixel.h"
#include "sensors/position.h"
#include "sensors/velocity.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    BodyPoints, EveryModel,
    ::testing::Values(
        SensorRow("body_velocity", "{roles: {velocity: vector(2)}, axes: x, sigma_m_s: 0.1}",
                  BodyVelocity<2, 1>({0}, {0.1}), {{1.0, -0.5}, {0.5}, {0.2}, {0.5, -0.2}, {0.1}}),
        SensorRow("position", "{roles: {position: vector(3)}, sigma_m: [0.1, 0.2, 0.3]}",
                  Position<3>({0.1, 0.2, 0.3}),
                  {kPosition, {0.6, 0.0, 0.8, 0.0}, {0.5, -0.2, 0.1}}),
        SensorRow("velocity", "{roles: {velocity: vector(2)}, sigma_m_s: 0.1}",
                  Velocity<2>({0.1, 0.1}), {{1.0, -0.5}, {0.5}, {0.2}, {0.5, -0.2}}),
        SensorRow("known_pixel",
                  "{point_m: [0.2, 0.4, 2], sigma_px: [1, 2], " + kSmallCameraText + "}",
                  FixedKnown<KnownPixel>(KnownPixel(kSmallCamera, {1.0, 2.0}), {0.2, 0.4, 2.0}),
                  {kPosition, kOrientation, {0.1, 0.0, 0.05}, kOrientation})),
    RowName);

}  // namespace
}  // namespace alidade::testing
