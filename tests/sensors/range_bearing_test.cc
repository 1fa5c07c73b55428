// SPDX-License-Identifier: Apache-2.0
#include "sensors/range_bearing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "alidade/estimation/direct_models.h"
#include "support/model_checks.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::ExpectSame;
using testing::kNumeric;
using testing::kPoison;
using testing::NumericSensorJacobian;
using testing::Pointers;
using testing::SensorJacobian;

SharedSensor MakeRangeBearing() {
  return MakeSensor(RangeBearing<Xyz>(0.1, 0.02, 10.0), "range_bearing");
}

// The sensor is at (1, 0, 0) m, rotated by 90 deg about z. The point is at (1, 3, 4) m.
const Blocks kRangeBearingRoles{{1, 0, 0}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}, {1, 3, 4}};

TEST(RangeBearing, PredictsWorkedNumbers) {
  const SharedSensor sensor = MakeRangeBearing();
  std::vector<double> z(4, kPoison);
  ASSERT_EQ(sensor->Predict(Pointers(kRangeBearingRoles).data(), z.data()), Status::kOk);
  ExpectSame(z, {5.0, 0.6, 0.0, 0.8}, 1e-15);  // the sensor's x axis points along the world's y
  EXPECT_EQ(sensor->measurement().elements,
            (std::vector<std::string>{"range", "bearing.x", "bearing.y", "bearing.z"}));
  ExpectSame(SensorJacobian(sensor, kRangeBearingRoles),
             NumericSensorJacobian(sensor, kRangeBearingRoles), kNumeric);
  std::vector<double> l(9, kPoison);
  ASSERT_EQ(sensor->SqrtNoise(Pointers(kRangeBearingRoles).data(), z.data(), l.data()),
            Status::kOk);
  EXPECT_EQ(l, (std::vector<double>{0.1, 0, 0, 0, 0.02, 0, 0, 0, 0.02}));
}

TEST(RangeBearing, SeesNothingWhereItStandsNorFurtherThanItsRange) {
  const SharedSensor sensor = MakeRangeBearing();
  std::vector<double> z(4, kPoison);
  const Blocks at_the_sensor{{1, 0, 0}, {1, 0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(sensor->Predict(Pointers(at_the_sensor).data(), z.data()), Status::kOutOfDomain);
  EXPECT_EQ(z, std::vector<double>(4, kPoison));
  for (const auto& [range, status] : {std::pair{9.9, Status::kOk},
                                      {10.1, Status::kInvalid},
                                      {0.0, Status::kInvalid},
                                      {-1.0, Status::kInvalid}}) {
    z = {range, 0, 0, 1};
    EXPECT_EQ(sensor->Valid({z.data()}), status) << range;
  }
}

// Initialise computes the point from a measurement, and Predict returns the same measurement. The
// Jacobians of both functions are inverses of each other.
TEST(RangeBearing, TellsThePoint) {
  const SharedSensor sensor = MakeRangeBearing();
  const std::vector<double> z{5.0, 0.6, 0.0, 0.8};
  std::vector<double> y(3, kPoison), jz(9, kPoison);
  std::vector<double*> jx(3, nullptr);
  ASSERT_EQ(sensor->Initialise(Pointers(kRangeBearingRoles).data(), {z.data()}, nullptr,
                               {.y = y.data(), .jx = jx.data(), .jz = jz.data()}),
            Status::kOk);
  ExpectSame(y, kRangeBearingRoles[2], 1e-15);
  const std::vector<double> j =
      SensorJacobian(sensor, kRangeBearingRoles);  // 3 x 9; the last columns are those of the point
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      double product = 0.0;
      for (std::size_t k = 0; k < 3; ++k) product += j[9 * r + 6 + k] * jz[3 * k + c];
      EXPECT_NEAR(product, r == c, 1e-14);
    }
  }
}

}  // namespace
}  // namespace alidade
