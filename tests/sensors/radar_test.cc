// SPDX-License-Identifier: Apache-2.0
#include "sensors/radar.h"

#include <gtest/gtest.h>

#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

// The target is 3 m east and 4 m north of the radar. It moves north at 2 m/s and the radar south
// at 3 m/s, so the range grows at 0.8 * 5 m/s.
TEST(Radar, MeasuresRangeAzimuthAndRate) {
  const SharedSensor sensor = MakeSensor(Radar<2, true, true, true>({0.1, 0.2, 0.3}), "radar");
  const Blocks roles{{4, 6}, {0, 2}, {1, 2}, {0, -3}};
  ExpectSame(Prediction(sensor, roles), {5, std::atan2(4, 3), 4}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles), (std::vector<double>{0.1, 0.2, 0.3}));
  ExpectTrueJacobian(sensor, roles);
  EXPECT_EQ(sensor->measurement().elements,
            (std::vector<std::string>{"range", "azimuth", "range_rate"}));
}

TEST(Radar, MeasuresElevationInSpace) {
  const Eigen::Vector3d h(1, -2, 0.5), u(0.3, 0.4, -0.5);
  const SharedSensor sensor = MakeSensor(Radar<3, true, true, true>({0.1, 0.2, 0.2, 0.3}), "radar");
  const Blocks roles{{2, 0, 3.5}, {0.3, 0.4, 0.5}, {1, 2, 3}, {0, 0, 1}};
  ExpectSame(Prediction(sensor, roles),
             {h.norm(), std::atan2(h[1], h[0]), std::asin(h[2] / h.norm()), h.normalized().dot(u)},
             1e-15);
  ExpectTrueJacobian(sensor, roles);
}

TEST(Radar, MeasuresASubset) {
  const Blocks roles{{4, 6}, {0, 2}, {1, 2}, {0, -3}};
  ExpectSame(Prediction(MakeSensor(Radar<2, false, false, true>({0.3}), "radar"), roles), {4},
             1e-15);
  const SharedSensor no_rate = MakeSensor(Radar<2, true, true, false>({0.1, 0.2}), "radar");
  ExpectSame(Prediction(no_rate, {{4, 6}, {}, {1, 2}, {0, 0}}), {5, std::atan2(4, 3)}, 1e-15);
}

TEST(Radar, IsNotDefinedAtTheRadar) {
  const Blocks above{{1, 2, 5}, {0, 0, 1}, {1, 2, 3}, {0, 0, 0}};
  ExpectOutOfDomain(MakeSensor(Radar<3, true, true, false>({0.1, 0.2, 0.2}), "radar"), above);
  ExpectSame(Prediction(MakeSensor(Radar<3, true, false, true>({0.1, 0.2}), "radar"), above),
             {2, 1}, 1e-15);
  ExpectOutOfDomain(MakeSensor(Radar<3, true, false, true>({0.1, 0.2}), "radar"),
                    {{1, 2, 3}, {0, 0, 1}, {1, 2, 3}, {0, 0, 0}});
}

}  // namespace
}  // namespace alidade
