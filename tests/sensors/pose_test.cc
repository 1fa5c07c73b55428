// SPDX-License-Identifier: Apache-2.0
#include "sensors/pose.h"

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

// Position in m and orientation world_from_body.
const Blocks kPoseRoles{{1.0, -2.0, 3.0}, {0.6, 0.0, 0.8, 0.0}};

SharedSensor MakePose() { return MakeSensor(Pose<3>({0.1, 0.2, 0.3}, {0.01, 0.02, 0.03}), "pose"); }

TEST(Pose, IsPositionAndOrientation) {
  const SharedSensor pose = MakePose();
  EXPECT_EQ(pose->measurement().geometry,
            Geometry::Product({Geometry::Vector(3), Geometry::UnitQuaternion()}));
  EXPECT_EQ(pose->measurement().elements[6], "orientation.z");
  std::vector<double> z(7, kPoison);
  ASSERT_EQ(pose->Predict(Pointers(kPoseRoles).data(), z.data()), Status::kOk);
  EXPECT_EQ(z, (std::vector<double>{1.0, -2.0, 3.0, 0.6, 0.0, 0.8, 0.0}));
  const std::vector<double> j = SensorJacobian(pose, kPoseRoles);
  for (std::size_t i = 0; i < 36; ++i) EXPECT_EQ(j[i], i % 7 == 0 ? 1.0 : 0.0);
  ExpectSame(j, NumericSensorJacobian(pose, kPoseRoles), kNumeric);
}

TEST(Pose, HasNoiseByAxisOfBoth) {
  const SharedSensor pose = MakePose();
  std::vector<double> z(7), l(36, kPoison);
  ASSERT_EQ(pose->SqrtNoise(Pointers(kPoseRoles).data(), z.data(), l.data()), Status::kOk);
  const double sigmas[6] = {0.1, 0.2, 0.3, 0.01, 0.02, 0.03};
  for (std::size_t i = 0; i < 36; ++i) EXPECT_EQ(l[i], i % 7 == 0 ? sigmas[i / 7] : 0.0);
}

TEST(Pose, TellsThePosition) {
  const SharedSensor pose = MakePose();
  ASSERT_EQ(pose->inverse().role, 0);
  const std::vector<double> z{4, 5, 6, 1, 0, 0, 0};
  std::vector<double> y(3, kPoison), jz(18, kPoison);
  std::vector<double*> jx(2, nullptr);
  ASSERT_EQ(pose->Initialise(Pointers(kPoseRoles).data(), {z.data()}, nullptr,
                             {.y = y.data(), .jx = jx.data(), .jz = jz.data()}),
            Status::kOk);
  EXPECT_EQ(y, (std::vector<double>{4, 5, 6}));
  for (std::size_t i = 0; i < 18; ++i) EXPECT_EQ(jz[i], i % 7 == 0 ? 1.0 : 0.0);
}

}  // namespace
}  // namespace alidade
