// SPDX-License-Identifier: Apache-2.0
#include "sensors/bearing_landmark.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The body is at (1, 2) m and heads along y. The landmark is 3 m ahead and 3 m to the right.
const Blocks kLandmarkRoles{{1, 2}, {M_PI / 2}, {4, 5}};

TEST(BearingLandmark, IsTheBearingInTheBody) {
  const SharedSensor sensor = MakeSensor(BearingLandmark<PlanarXyz>(0.1), "bearing_landmark");
  ExpectSame(Prediction(sensor, kLandmarkRoles), {-M_PI / 4}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, kLandmarkRoles), std::vector<double>{0.1});
  ExpectTrueJacobian(sensor, kLandmarkRoles);
  ExpectOutOfDomain(sensor, {{1, 2}, {0}, {1, 2}});
}

TEST(BearingLandmark, PlacesALandmarkAtThePriorDistance) {
  const SharedSensor sensor = MakeSensor(BearingLandmark<PlanarXyz>(0.1), "bearing_landmark");
  EXPECT_EQ(sensor->inverse().prior_size, 1);
  const double inverse_distance = 1.0 / std::sqrt(18.0);
  ExpectSame(Initialised(sensor, kLandmarkRoles, {-M_PI / 4}, &inverse_distance), {4, 5}, 1e-15);
}

// The ray starts at (-1, 5) m and reaches the landmark at (4, 5) m after 5 m.
TEST(BearingLandmark, IsTheSameByTheInverseDistance) {
  const SharedSensor sensor = MakeSensor(BearingLandmark<PlanarInverseDepth>(0.1), "inverse");
  const Blocks roles{{1, 2}, {M_PI / 2}, {-1, 5, 0, 0.2}};
  ExpectSame(Prediction(sensor, roles), {-M_PI / 4}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
  ExpectOutOfDomain(sensor, {{4, 5}, {0}, {-1, 5, 0, 0.2}});
}

TEST(BearingLandmark, SeesAPointAtInfinity) {
  const SharedSensor sensor = MakeSensor(BearingLandmark<PlanarInverseDepth>(0.1), "inverse");
  const Blocks roles{{1, 2}, {0.5}, {-1, 5, 0.75, 0}};
  ExpectSame(Prediction(sensor, roles), {0.25}, 1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(BearingLandmark, StartsTheRayAtTheBody) {
  const SharedSensor sensor = MakeSensor(BearingLandmark<PlanarInverseDepth>(0.1), "inverse");
  const double inverse_distance = 0.0;
  ExpectSame(Initialised(sensor, {{1, 2}, {0.5}, {0, 0, 0, 0}}, {0.25}, &inverse_distance),
             {1, 2, 0.75, 0}, 1e-15);
}

}  // namespace
}  // namespace alidade
