// SPDX-License-Identifier: Apache-2.0
#include "sensors/scale_2d.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiSensor;
using testing::Blocks;
using testing::ExpectSame;
using testing::kNaN;
using testing::kNumeric;
using testing::kPoison;
using testing::MapHost;
using testing::NumericSensorJacobian;
using testing::Pointers;
using testing::SensorJacobian;

// lambda = 3 /m and Z = 0.5 m, so s = 1.5.
const MapHost::Values kScale{{"noise_model", {0}}, {"template_px", {300}}, {"sigma_px", {1}}};
const Blocks kScaleRoles{{0.5}, {3.0}};

TEST(Scale2d, PredictsWorkedNumbers) {
  const auto scale = AbiSensor<Scale2d>(kScale);
  double s = kPoison, sigma = kPoison;
  const auto roles = Pointers(kScaleRoles);
  ASSERT_EQ(scale->Predict(roles.data(), &s), Status::kOk);
  EXPECT_DOUBLE_EQ(s, 1.5);
  EXPECT_EQ(SensorJacobian(scale, kScaleRoles), (std::vector<double>{3.0, 0.5}));
  ExpectSame(SensorJacobian(scale, kScaleRoles), NumericSensorJacobian(scale, kScaleRoles),
             kNumeric);
  // The sigma is (2 * 1 / 300) * 1.5^3 = 0.0225.
  ASSERT_EQ(scale->SqrtNoise(roles.data(), &s, &sigma), Status::kOk);
  EXPECT_DOUBLE_EQ(sigma, 0.0225);
}

TEST(Scale2d, NoiseMayBeConstant) {
  const SharedSensor scale =
      AbiSensor<Scale2d>({{"noise_model", {1}}, {"sigma_inverse_scale", {0.02}}});
  double s = 1.5, sigma = kPoison;
  ASSERT_EQ(scale->SqrtNoise(Pointers(kScaleRoles).data(), &s, &sigma), Status::kOk);
  EXPECT_DOUBLE_EQ(sigma, 0.02);
}

TEST(Scale2d, IsDefinedForPositiveDepthAndInverseDepth) {
  const auto scale = AbiSensor<Scale2d>(kScale);
  for (const Blocks& roles : {Blocks{{0.0}, {3.0}}, Blocks{{0.5}, {0.0}}, Blocks{{-1.0}, {-3.0}},
                              Blocks{{kNaN}, {3.0}}, Blocks{{0.5}, {kNaN}}}) {
    double s = kPoison;
    EXPECT_EQ(scale->Predict(Pointers(roles).data(), &s), Status::kOutOfDomain);
    EXPECT_EQ(s, kPoison);
  }
  for (const double bad : {0.0, -1.5, kNaN}) EXPECT_EQ(scale->Valid({&bad}), Status::kInvalid);
}

TEST(Scale2d, InitialisesTheInverseDistance) {
  const auto scale = AbiSensor<Scale2d>(kScale);
  ASSERT_EQ(scale->inverse().role, 1);
  const double depth_m = 0.5, s = 1.5;
  const double* roles[] = {&depth_m, nullptr};
  double y = kPoison, j_depth = kPoison, untouched = kPoison, j_s = kPoison;
  double* jx[] = {&j_depth, &untouched};
  ASSERT_EQ(scale->Initialise(roles, {&s}, nullptr, {.y = &y, .jx = jx, .jz = &j_s}), Status::kOk);
  EXPECT_DOUBLE_EQ(y, 3.0);
  EXPECT_DOUBLE_EQ(j_depth, -6.0);  // lambda = s / Z, so d lambda / dZ = -s / Z^2
  EXPECT_DOUBLE_EQ(j_s, 2.0);       // d lambda / ds = 1 / Z
  EXPECT_EQ(untouched, kPoison);
}

}  // namespace
}  // namespace alidade
