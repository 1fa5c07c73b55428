// SPDX-License-Identifier: Apache-2.0
#include "sensors/relative_pose.h"

#include <gtest/gtest.h>

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

// The body is at (1, 2, 3) m, rotated by 90 degrees about z, so its x axis points along the y axis
// of the world.
const double kHalf = std::sqrt(0.5);
const Blocks kRoles{{1, 2, 3}, {kHalf, 0, 0, kHalf}, {1, 6, 3.5}, {kHalf, kHalf, 0, 0}};

SharedSensor MakeRelativePose() {
  return MakeSensor(RelativePose<3>({0.1, 0.2, 0.3}, {0.01, 0.02, 0.03}), "relative_pose");
}

TEST(RelativePose, IsThatOfTheLandmarkInTheBody) {
  const SharedSensor sensor = MakeRelativePose();
  std::vector<double> z(7, kPoison);
  ASSERT_EQ(sensor->Predict(Pointers(kRoles).data(), z.data()), Status::kOk);
  // The landmark is 4 m ahead of the body and 0.5 m above it. The relative rotation is -90 degrees
  // about z, then 90 degrees about x.
  ExpectSame(z, {4, 0, 0.5, 0.5, 0.5, -0.5, -0.5}, 1e-15);
  ExpectSame(SensorJacobian(sensor, kRoles), NumericSensorJacobian(sensor, kRoles), kNumeric);
}

TEST(RelativePose, PlacesTheLandmarkWhereItWasMeasured) {
  const SharedSensor sensor = MakeRelativePose();
  ASSERT_EQ(sensor->inverse().role, 2);
  std::vector<double> z(7), y(7, kPoison), j_z(36, kPoison), j_r(18, kPoison), j_q(18, kPoison);
  ASSERT_EQ(sensor->Predict(Pointers(kRoles).data(), z.data()), Status::kOk);
  std::vector<double*> j{j_r.data(), j_q.data(), nullptr, nullptr};
  ASSERT_EQ(sensor->Initialise(Pointers(kRoles).data(), {z.data()}, nullptr,
                               {.y = y.data(), .jx = j.data(), .jz = j_z.data()}),
            Status::kOk);
  ExpectSame(y, {1, 6, 3.5, kHalf, kHalf, 0, 0}, 1e-15);
}

// If the relative pose is neutral, the landmark has the pose of the body: dy = (dr, dq).
TEST(RelativePose, AKeyframeIsACloneOfTheBody) {
  const SharedSensor sensor = MakeRelativePose();
  const std::vector<double> neutral{0, 0, 0, 1, 0, 0, 0};
  std::vector<double> y(7, kPoison), j_z(36, kPoison), j_r(18, kPoison), j_q(18, kPoison);
  std::vector<double*> j{j_r.data(), j_q.data(), nullptr, nullptr};
  ASSERT_EQ(sensor->Initialise(Pointers(kRoles).data(), {neutral.data()}, nullptr,
                               {.y = y.data(), .jx = j.data(), .jz = j_z.data()}),
            Status::kOk);
  ExpectSame(y, {1, 2, 3, kHalf, 0, 0, kHalf}, 0.0);
  for (std::size_t i = 0; i < 18; ++i) {
    EXPECT_NEAR(j_r[i], i < 9 && i % 4 == 0 ? 1.0 : 0.0, 1e-15) << i;
    EXPECT_NEAR(j_q[i], i >= 9 && (i - 9) % 4 == 0 ? 1.0 : 0.0, 1e-15) << i;
  }
}

}  // namespace
}  // namespace alidade
