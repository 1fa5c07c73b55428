// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/fixed_known.h"
#include "every_model_fixture.h"
#include "sensors/bearing.h"
#include "sensors/bearing_landmark.h"
#include "sensors/range_bearing.h"

namespace alidade::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(
    Bearings, EveryModel,
    ::testing::Values(
        SensorRow("bearing", "{roles: {position: vector(2)}, sigma_rad: 0.01}", Bearing(0.01),
                  {{0.1, -0.1}, {0.5}, {0.2, 0.1}, {0.1}}),
        SensorRow("bearing", "{roles: {position: vector(3)}, sigma_rad: 0.01}",
                  BearingUnitVector(0.01),
                  {kPosition, kOrientation, {0.1, 0.0, 0.05}, {0.6, 0.0, 0.8, 0.0}}),
        SensorRow("bearing",
                  "{roles: {position: vector(3)}, measures: angles, point_m: [8, 1, 0.5], "
                  "sigma_rad: 0.01}",
                  FixedKnown<BearingAngles>(BearingAngles(0.01), {8.0, 1.0, 0.5}),
                  {kPosition, kOrientation, {0.1, 0.0, 0.05}, kOrientation}),
        SensorRow("bearing_landmark", "{sigma_rad: 0.01, landmarks: {representation: xyz}}",
                  BearingLandmark<PlanarXyz>(0.01), {{0.1, -0.1}, {0.5}, {8.0, 5.0}}),
        SensorRow("bearing_landmark", "{sigma_rad: 0.01}",
                  BearingLandmark<PlanarInverseDepth>(0.01),
                  {{0.1, -0.1}, {0.5}, {0.3, 0.2, 0.4, 0.1}}),
        SensorRow("range_bearing",
                  "{roles: {position: vector(2)}, sigma_range_m: 0.1, sigma_bearing_rad: 0.01}",
                  PlanarRangeBearing(0.1, 0.01), {{0.1, -0.1}, {0.5}, {8.0, 5.0}}),
        SensorRow("range_bearing",
                  "{roles: {position: vector(2)}, target: point, sigma_range_m: 0.1, "
                  "sigma_bearing_rad: 0.01}",
                  RangeBearingToPoint<2>(0.1, 0.01), {{0.1, -0.1}, {0.5}, {0.2, 0.1}, {0.1}}),
        SensorRow("range_bearing",
                  "{target: point, point_m: [8, 1, 0.5], sigma_range_m: 0.1, "
                  "sigma_bearing_rad: 0.01}",
                  FixedKnown<RangeBearingToPoint<3>>(RangeBearingToPoint<3>(0.1, 0.01),
                                                     {8.0, 1.0, 0.5}),
                  {kPosition, kOrientation, {0.1, 0.0, 0.05}, kOrientation})),
    RowName);

}  // namespace
}  // namespace alidade::testing
