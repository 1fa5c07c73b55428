// SPDX-License-Identifier: Apache-2.0
#include "sensors/stereo_disparity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiSensor;
using testing::Blocks;
using testing::ExpectSame;
using testing::kNaN;
using testing::kPoison;
using testing::MapHost;
using testing::NumericSensorJacobian;
using testing::SensorJacobian;

// f = 400 px, B = 0.065 m and Z = 0.5 m, so d = 400 * 0.065 / 0.5 = 52 px.
const MapHost::Values kStereo{
    {"focal_px", {400}}, {"baseline_m", {0.065}}, {"sigma_px", {1.5}}, {"min_range_m", {0.2}}};

TEST(StereoDisparity, PredictsWorkedNumbers) {
  const auto stereo = AbiSensor<StereoDisparity>(kStereo);
  double disparity_px = kPoison, sigma_px = kPoison;
  const double depth_m = 0.5;
  const double* roles[] = {&depth_m};
  ASSERT_EQ(stereo->Predict(roles, &disparity_px), Status::kOk);
  EXPECT_DOUBLE_EQ(disparity_px, 52.0);
  // -f B / Z^2 = -26 / 0.25
  EXPECT_DOUBLE_EQ(SensorJacobian(stereo, {{0.5}})[0], -104.0);
  ASSERT_EQ(stereo->SqrtNoise(roles, &disparity_px, &sigma_px), Status::kOk);
  EXPECT_EQ(sigma_px, 1.5);
}

TEST(StereoDisparity, JacobianIsTrue) {
  const auto stereo = AbiSensor<StereoDisparity>(kStereo);
  for (const double depth_m : {0.3, 0.5, 2.0, 10.0}) {
    const Blocks roles{{depth_m}};
    ExpectSame(SensorJacobian(stereo, roles), NumericSensorJacobian(stereo, roles), 3e-9);
  }
}

TEST(StereoDisparity, BehindTheCameraIsOutOfDomainAndWritesNothing) {
  const auto stereo = AbiSensor<StereoDisparity>(kStereo);
  for (const double depth_m : {0.0, -0.5, kNaN}) {
    double z = kPoison, j = kPoison;
    const double* roles[] = {&depth_m};
    double* jacobians[] = {&j};
    const int stride = 1;
    EXPECT_EQ(stereo->Linearise(roles, &z, jacobians, &stride), Status::kOutOfDomain);
    EXPECT_EQ(stereo->Predict(roles, &z), Status::kOutOfDomain);
    EXPECT_EQ(z, kPoison);
    EXPECT_EQ(j, kPoison);
  }
}

TEST(StereoDisparity, IsInvalidNearerThanTheLimit) {
  const auto stereo = AbiSensor<StereoDisparity>(kStereo);
  // The largest valid disparity is f B / near = 26 / 0.2 = 130 px.
  for (const double ok : {1e-9, 52.0, 129.999}) EXPECT_EQ(stereo->Valid({&ok}), Status::kOk) << ok;
  for (const double bad : {0.0, -1.0, 130.001, kNaN}) {
    EXPECT_EQ(stereo->Valid({&bad}), Status::kInvalid) << bad;
  }
}

TEST(StereoDisparity, InitialisesTheDepth) {
  const auto stereo = AbiSensor<StereoDisparity>(kStereo);
  ASSERT_EQ(stereo->inverse().role, 0);
  const double disparity_px = 52.0, negative_px = -1.0;
  const double* roles[] = {nullptr};
  double* jx[] = {nullptr};
  double depth_m = kPoison, j_depth_disparity = kPoison;
  ASSERT_EQ(stereo->Initialise(roles, {&disparity_px}, nullptr,
                               {.y = &depth_m, .jx = jx, .jz = &j_depth_disparity}),
            Status::kOk);
  EXPECT_DOUBLE_EQ(depth_m, 0.5);
  EXPECT_DOUBLE_EQ(j_depth_disparity, -26.0 / (52.0 * 52.0));
  depth_m = kPoison;
  EXPECT_EQ(stereo->Initialise(roles, {&negative_px}, nullptr, {.y = &depth_m, .jx = jx}),
            Status::kOutOfDomain);
  EXPECT_EQ(depth_m, kPoison);
}

TEST(StereoDisparity, DescribesItself) {
  const auto stereo = AbiSensor<StereoDisparity>(kStereo);
  ASSERT_EQ(stereo->roles().size(), 1u);
  EXPECT_EQ(stereo->roles()[0].name, "depth");
  EXPECT_EQ(stereo->roles()[0].unit, "m");
  EXPECT_EQ(stereo->roles()[0].geometry, Geometry::Vector(1));
  EXPECT_EQ(stereo->measurement().name, "disparity");
  EXPECT_EQ(stereo->measurement().elements, std::vector<std::string>{""});
}

TEST(StereoDisparity, AsksForWhatIsMissing) {
  const MapHost host({{"focal_px", {400}}});
  static_cast<void>(testing::MakeInstance(&EmplaceSensor<StereoDisparity>, host));
  std::vector<std::string> missing = host.missing();
  std::sort(missing.begin(), missing.end());
  EXPECT_EQ(missing, (std::vector<std::string>{"baseline_m", "sigma_px"}));
}

}  // namespace
}  // namespace alidade
