// SPDX-License-Identifier: Apache-2.0
// The models that alidade ships, through the C boundary.
#include <gtest/gtest.h>

#include <algorithm>

#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::Covariance;
using testing::ExpectSame;
using testing::ExpectTrueJacobians;
using testing::kNaN;
using testing::kNumeric;
using testing::kPoison;
using testing::Linearised;
using testing::MakeMotion;
using testing::MakeSensor;
using testing::MapHost;
using testing::NumericallyLinearised;
using testing::Pointers;
using testing::Step;
using testing::Stepped;

// ---- stereo_disparity: f = 400 px, B = 0.065 m, Z = 0.5 m: d = 400 0.065 / 0.5 = 52 px ----------

const MapHost::Values kStereo{
    {"focal_px", {400}}, {"baseline_m", {0.065}}, {"sigma_px", {1.5}}, {"near_m", {0.2}}};

TEST(StereoDisparity, PredictsWorkedNumbers) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  double disparity_px = kPoison, sigma_px = kPoison;
  const double depth_m = 0.5;
  const double* roles[] = {&depth_m};
  ASSERT_EQ(stereo.Predict(roles, &disparity_px), Status::kOk);
  EXPECT_DOUBLE_EQ(disparity_px, 52.0);
  // -f B / Z^2 = -26 / 0.25
  EXPECT_DOUBLE_EQ(Linearised(stereo, {{0.5}})[0], -104.0);
  ASSERT_EQ(stereo.SqrtNoise(roles, &disparity_px, &sigma_px), Status::kOk);
  EXPECT_EQ(sigma_px, 1.5);
}

TEST(StereoDisparity, JacobianIsTrue) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  for (const double depth_m : {0.3, 0.5, 2.0, 10.0}) {
    const Blocks roles{{depth_m}};
    ExpectSame(Linearised(stereo, roles), NumericallyLinearised(stereo, roles), 3e-9);
  }
}

TEST(StereoDisparity, BehindTheCameraIsOutOfDomainAndWritesNothing) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  for (const double depth_m : {0.0, -0.5, kNaN}) {
    double z = kPoison, j = kPoison;
    const double* roles[] = {&depth_m};
    double* jacobians[] = {&j};
    const int stride = 1;
    EXPECT_EQ(stereo.Linearise(roles, &z, jacobians, &stride), Status::kOutOfDomain);
    EXPECT_EQ(stereo.Predict(roles, &z), Status::kOutOfDomain);
    EXPECT_EQ(z, kPoison);
    EXPECT_EQ(j, kPoison);
  }
}

TEST(StereoDisparity, IsInvalidNearerThanTheLimit) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  // f B / near = 26 / 0.2 = 130 px
  for (const double ok : {1e-9, 52.0, 129.999}) EXPECT_EQ(stereo.Valid(&ok), Status::kOk) << ok;
  for (const double bad : {0.0, -1.0, 130.001, kNaN}) {
    EXPECT_EQ(stereo.Valid(&bad), Status::kInvalid) << bad;
  }
}

TEST(StereoDisparity, InitialisesTheDepth) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  ASSERT_EQ(stereo.initialised_role(), 0);
  const double disparity_px = 52.0, negative_px = -1.0;
  const double* roles[] = {nullptr};
  double* jx[] = {nullptr};
  double depth_m = kPoison, j_depth_disparity = kPoison;
  ASSERT_EQ(stereo.Initialise(roles, &disparity_px, &depth_m, jx, &j_depth_disparity), Status::kOk);
  EXPECT_DOUBLE_EQ(depth_m, 0.5);
  EXPECT_DOUBLE_EQ(j_depth_disparity, -26.0 / (52.0 * 52.0));
  depth_m = kPoison;
  EXPECT_EQ(stereo.Initialise(roles, &negative_px, &depth_m, jx, nullptr), Status::kOutOfDomain);
  EXPECT_EQ(depth_m, kPoison);
}

TEST(StereoDisparity, DescribesItself) {
  const SensorModel stereo = MakeSensor<StereoDisparity>(kStereo);
  ASSERT_EQ(stereo.roles().size(), 1u);
  EXPECT_EQ(stereo.roles()[0].name, "depth");
  EXPECT_EQ(stereo.roles()[0].unit, "m");
  EXPECT_EQ(stereo.roles()[0].geometry, Geometry::Vector(1));
  EXPECT_EQ(stereo.measurement().name, "disparity");
  EXPECT_EQ(stereo.measurement().elements, std::vector<std::string>{""});
}

TEST(StereoDisparity, AsksForWhatIsMissing) {
  const MapHost host({{"focal_px", {400}}});
  static_cast<void>(testing::MakeInstance(&EmplaceSensor<StereoDisparity>, host));
  std::vector<std::string> missing = host.missing();
  std::sort(missing.begin(), missing.end());
  EXPECT_EQ(missing, (std::vector<std::string>{"baseline_m", "sigma_px"}));
}

// ---- scale_2d: lambda = 3 1/m, Z = 0.5 m: s = 1.5 -----------------------------------------------

const MapHost::Values kScale{{"noise", {0}}, {"template_px", {300}}, {"sigma_px", {1}}};
const Blocks kScaleRoles{{0.5}, {3.0}};

TEST(Scale2d, PredictsWorkedNumbers) {
  const SensorModel scale = MakeSensor<Scale2d>(kScale);
  double s = kPoison, sigma = kPoison;
  const auto roles = Pointers(kScaleRoles);
  ASSERT_EQ(scale.Predict(roles.data(), &s), Status::kOk);
  EXPECT_DOUBLE_EQ(s, 1.5);
  EXPECT_EQ(Linearised(scale, kScaleRoles), (std::vector<double>{3.0, 0.5}));
  ExpectSame(Linearised(scale, kScaleRoles), NumericallyLinearised(scale, kScaleRoles), kNumeric);
  // (2 1 / 300) 1.5^3 = 0.0225
  ASSERT_EQ(scale.SqrtNoise(roles.data(), &s, &sigma), Status::kOk);
  EXPECT_DOUBLE_EQ(sigma, 0.0225);
}

TEST(Scale2d, NoiseMayBeFixed) {
  const SensorModel scale = MakeSensor<Scale2d>({{"noise", {1}}, {"variance", {4e-4}}});
  double s = 1.5, sigma = kPoison;
  ASSERT_EQ(scale.SqrtNoise(Pointers(kScaleRoles).data(), &s, &sigma), Status::kOk);
  EXPECT_DOUBLE_EQ(sigma, 0.02);
}

TEST(Scale2d, IsDefinedForPositiveDepthAndInverseDepth) {
  const SensorModel scale = MakeSensor<Scale2d>(kScale);
  for (const Blocks& roles : {Blocks{{0.0}, {3.0}}, Blocks{{0.5}, {0.0}}, Blocks{{-1.0}, {-3.0}},
                              Blocks{{kNaN}, {3.0}}, Blocks{{0.5}, {kNaN}}}) {
    double s = kPoison;
    EXPECT_EQ(scale.Predict(Pointers(roles).data(), &s), Status::kOutOfDomain);
    EXPECT_EQ(s, kPoison);
  }
  for (const double bad : {0.0, -1.5, kNaN}) EXPECT_EQ(scale.Valid(&bad), Status::kInvalid);
}

TEST(Scale2d, InitialisesTheInverseDistance) {
  const SensorModel scale = MakeSensor<Scale2d>(kScale);
  ASSERT_EQ(scale.initialised_role(), 1);
  const double depth_m = 0.5, s = 1.5;
  const double* roles[] = {&depth_m, nullptr};
  double y = kPoison, j_depth = kPoison, untouched = kPoison, j_s = kPoison;
  double* jx[] = {&j_depth, &untouched};
  ASSERT_EQ(scale.Initialise(roles, &s, &y, jx, &j_s), Status::kOk);
  EXPECT_DOUBLE_EQ(y, 3.0);
  EXPECT_DOUBLE_EQ(j_depth, -6.0);  // -s / Z^2
  EXPECT_DOUBLE_EQ(j_s, 2.0);       // 1 / Z
  EXPECT_EQ(untouched, kPoison);
}

// ---- constant --------------------------------------------------------------------------------

TEST(Constant, StaysAndHasNoNoise) {
  const MotionModel constant = MakeMotion<Constant<>>();
  EXPECT_EQ(constant.noise_size(), 0);
  const Stepped out = Step(constant, {{3.3}}, nullptr, nullptr, 0.1);
  EXPECT_EQ(out.next[0][0], 3.3);
  EXPECT_EQ(out.f[0], 1.0);
}

TEST(Constant, WalksWithTheRootOfTime) {
  const MotionModel walk = MakeMotion<Constant<>>({{"size", {3}}, {"noise.random_walk", {0.2}}});
  ASSERT_EQ(walk.noise_size(), 3);
  EXPECT_EQ(walk.blocks()[0].elements, (std::vector<std::string>{"0", "1", "2"}));
  const Blocks x{{1, 2, 3}};
  EXPECT_EQ(Step(walk, x, nullptr, nullptr, 0.25).next, x) << "no noise given is zero noise";
  ExpectTrueJacobians(walk, x, nullptr, {0.1, -0.2, 0.3}, 0.25);
  // 0.2^2 0.25 = 0.01
  ExpectSame(Covariance(walk, x, 0.25), {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01}, 1e-15);
}

// ---- constant_velocity -------------------------------------------------------------------------

template <int D, bool kWhite>
void CheckConstantVelocity() {
  const double sigma = 0.7, dt_s = 0.2;
  const MotionModel motion =
      MakeMotion<ConstantVelocity<D, kWhite>>({{"noise.acceleration", {sigma}}});
  ASSERT_EQ(motion.noise_size(), kWhite ? 2 * D : D);
  Blocks x{std::vector<double>(D), std::vector<double>(D)};
  std::vector<double> w(motion.noise_size());
  for (int i = 0; i < D; ++i) x[0][i] = 1.0 + i, x[1][i] = -0.5 * i + 0.25;
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = 0.3 - 0.1 * static_cast<double>(i);
  const Stepped out = Step(motion, x, nullptr, nullptr, dt_s);
  for (int i = 0; i < D; ++i) {
    EXPECT_DOUBLE_EQ(out.next[0][i], x[0][i] + dt_s * x[1][i]);
    EXPECT_EQ(out.next[1][i], x[1][i]);
  }
  ExpectTrueJacobians(motion, x, nullptr, w, dt_s);
  // G Qw G' per axis: piecewise sigma^2 [dt^4/4 dt^3/2; . dt^2], white sigma^2 [dt^3/3 dt^2/2; .
  // dt]
  const double s2 = sigma * sigma, t = dt_s;
  const double pp = kWhite ? t * t * t / 3 : t * t * t * t / 4;
  const double pv = kWhite ? t * t / 2 : t * t * t / 2;
  const double vv = kWhite ? t : t * t;
  const std::vector<double> q = Covariance(motion, x, dt_s);
  const int n = 2 * D, m = motion.noise_size();
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      double sum = 0.0;
      for (int i = 0; i < m * m; ++i) {
        sum += out.g[r * m + i / m] * q[i] * out.g[c * m + i % m];
      }
      const double axis = r < D && c < D ? pp : r >= D && c >= D ? vv : pv;
      EXPECT_NEAR(sum, r % D == c % D ? s2 * axis : 0.0, 1e-16) << r << ' ' << c;
    }
  }
}

TEST(ConstantVelocity, MovesAndSpreadsAsItsEquationsSay) {
  CheckConstantVelocity<1, false>();
  CheckConstantVelocity<2, false>();
  CheckConstantVelocity<3, false>();
  CheckConstantVelocity<1, true>();
  CheckConstantVelocity<2, true>();
  CheckConstantVelocity<3, true>();
}

}  // namespace
}  // namespace alidade
