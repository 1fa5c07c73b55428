// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "alidade/model/fixed_known.h"
#include "sensors/range_bearing.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body is at (1, 2) m and heads along y. The landmark is 3 m ahead and 3 m to the right.
const Blocks kPlanarRoles{{1, 2}, {M_PI / 2}, {4, 5}};

TEST(PlanarRangeBearing, MeasuresALandmark) {
  const SharedSensor sensor = MakeSensor(PlanarRangeBearing(0.1, 0.02), "range_bearing");
  ExpectSame(Prediction(sensor, kPlanarRoles), {std::sqrt(18.0), -M_PI / 4}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, kPlanarRoles), (std::vector<double>{0.1, 0.02}));
  ExpectTrueJacobian(sensor, kPlanarRoles);
  ExpectOutOfDomain(sensor, {{1, 2}, {0}, {1, 2}});
}

TEST(PlanarRangeBearing, PlacesTheLandmarkAtTheMeasurement) {
  const SharedSensor sensor = MakeSensor(PlanarRangeBearing(0.1, 0.02), "range_bearing");
  ExpectSame(Initialised(sensor, kPlanarRoles, {std::sqrt(18.0), -M_PI / 4}), {4, 5}, 1e-15);
}

}  // namespace
}  // namespace alidade
