// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/static_ekf.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "alidade/base/statistics.h"
#include "motion_models/constant.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

using DepthEkf = StaticEkf<ConstantVelocity<1, false>, Constant<1>>;
constexpr int kDepth = 0, kRate = 1, kInverseDistance = 2;

DepthEkf StaticDepthFilter() {
  DepthEkf filter(ConstantVelocity<1, false>(1.0), Constant<1>(1));
  filter.Set<kDepth>(0.35, 0.1);
  filter.Set<kRate>(0.0, 0.5);
  filter.Set<kInverseDistance>(3.3, 0.5);
  return filter;
}

StaticOutcome ToStatic(Outcome outcome) {
  switch (outcome) {
    case Outcome::kAccepted:
      return StaticOutcome::kAccepted;
    case Outcome::kGated:
      return StaticOutcome::kGated;
    case Outcome::kInvalid:
      return StaticOutcome::kInvalid;
    case Outcome::kOutOfDomain:
      return StaticOutcome::kOutOfDomain;
    default:
      return StaticOutcome::kNotFinite;
  }
}

TEST(StaticEkf, IsTheEngineComposedAtCompileTime) {
  const Problem problem = DepthFilter();
  EkfOptions options;
  options.fuse = Fuse::kPerMeasurement;
  options.gate = 0.99;
  Ekf engine(problem, options, StreamsOf(problem));
  DepthEkf filter = StaticDepthFilter();
  const StereoDisparity stereo(400.0, 0.065, 1.0);
  const Scale2d scale = Scale2d::FromPixels(300.0, 1.0);
  const double gate = ChiSquareQuantile(0.99, 1);
  int gated = 0, invalid = 0;
  for (int k = 0; k < 300; ++k) {
    const double t = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t);
    const double d =
        k % 17 == 3 ? -1.0 : 26.0 / depth + std::sin(7.0 * k) + (k % 13 == 5 ? 9.0 : 0.0);
    const double s = depth / 0.3 + 0.01 * std::cos(5.0 * k);
    const UpdateReport& report = engine.Process(FrameAt(t, {{0, d}, {1, s}}));
    if (k > 0) {
      const double dt = Seconds(TimestampFromSeconds(t) - TimestampFromSeconds(0.033 * (k - 1)));
      ASSERT_EQ(filter.Predict(dt), Status::kOk);
    }
    const StaticOutcome of_d = filter.Update<kDepth>(stereo, &d, gate);
    ASSERT_EQ(of_d, ToStatic(report.measurements()[0].outcome)) << k;
    ASSERT_EQ((filter.Update<kDepth, kInverseDistance>(scale, &s, gate)),
              ToStatic(report.measurements()[1].outcome));
    gated += of_d == StaticOutcome::kGated ? 1 : 0;
    invalid += of_d == StaticOutcome::kInvalid ? 1 : 0;
    ASSERT_NEAR(*filter.value<kDepth>(), ValueOf(engine.state(), "target.depth"), 1e-12);
    ASSERT_NEAR(*filter.value<kRate>(), ValueOf(engine.state(), "target.depth_rate"), 1e-11);
    ASSERT_NEAR(*filter.value<kInverseDistance>(),
                ValueOf(engine.state(), "template.inverse_distance"), 1e-11);
    ASSERT_LT((filter.covariance() - engine.state().covariance().Dense()).norm(), 1e-12);
  }
  EXPECT_GT(gated, 5);
  EXPECT_GT(invalid, 10);
}

TEST(StaticEkf, HoldsDiscreteNoiseOverAGapOfManySteps) {
  DepthEkf whole = StaticDepthFilter(), split = StaticDepthFilter();
  const StereoDisparity stereo(400.0, 0.065, 1.0);
  for (int k = 0; k < 20; ++k) {
    ASSERT_EQ(whole.Predict(0.05), Status::kOk);
    for (const double dt : {0.01, 0.005, 0.035}) ASSERT_EQ(split.Predict(dt), Status::kOk);
    const double d = 80.0 + std::sin(7.0 * k);
    ASSERT_EQ(whole.Update<kDepth>(stereo, &d), StaticOutcome::kAccepted);
    ASSERT_EQ(split.Update<kDepth>(stereo, &d), StaticOutcome::kAccepted);
    ASSERT_NEAR(*whole.value<kDepth>(), *split.value<kDepth>(), 1e-13);
    ASSERT_LT((whole.covariance() - split.covariance()).norm(), 1e-13);
  }
}

/// Measures two elements with correlated noise. Each of the two roles has two elements.
struct Difference : Sensor<Vec<2>, Vec<2>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"a", "m", "", "x,y"}, Quantity{"b", "m", "", "x,y"}};
  static constexpr Quantity kMeasurement{"z", "m", "", "x,y"};
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    for (int i = 0; i < 2; ++i) z[i] = a[i] * b[0] - b[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.5);
    l[2] = T(0.2);
    l[3] = T(0.4);
  }
};

TEST(StaticEkf, UpdatesWithVectorsAndDerivedJacobiansAsTheTextbookSays) {
  StaticEkf<Constant<2>, ConstantVelocity<2, false>> filter(Constant<2>(2, 0.3),
                                                            ConstantVelocity<2, false>(2.0));
  const double a[] = {1.0, 2.0}, b[] = {0.5, -0.3}, v[] = {0.1, 0.2};
  Eigen::Matrix2d own;
  own << 0.4, 0.1, 0.1, 0.3;
  filter.Set<0>(a, own);
  filter.Set<1>(b, 2.0 * own);
  filter.Set<2>(v, 0.5 * own);
  constexpr double kDt = 0.5;
  ASSERT_EQ(filter.Predict(kDt), Status::kOk);
  // The expected values are computed by hand, in the order a, b, v.
  Eigen::Matrix<double, 6, 6> f = Eigen::Matrix<double, 6, 6>::Identity(), p = f, q = 0.0 * f;
  p.setZero();
  p.block<2, 2>(0, 0) = own;
  p.block<2, 2>(2, 2) = 2.0 * own;
  p.block<2, 2>(4, 4) = 0.5 * own;
  f(2, 4) = f(3, 5) = kDt;
  q(0, 0) = q(1, 1) = 0.09 * kDt;
  for (int i = 0; i < 2; ++i) {
    q(2 + i, 2 + i) = 4.0 * std::pow(kDt, 4) / 4.0;
    q(2 + i, 4 + i) = q(4 + i, 2 + i) = 4.0 * std::pow(kDt, 3) / 2.0;
    q(4 + i, 4 + i) = 4.0 * kDt * kDt;
  }
  p = f * p * f.transpose() + q;
  EXPECT_LT((filter.covariance() - p).norm(), 1e-14);
  Eigen::Matrix<double, 6, 1> x;
  x << 1.0, 2.0, 0.55, -0.2, 0.1, 0.2;
  Eigen::Matrix<double, 2, 6> h = Eigen::Matrix<double, 2, 6>::Zero();
  h(0, 0) = h(1, 1) = x(2);
  h(0, 2) = x(0) - 1.0;
  h(1, 2) = x(1);
  h(1, 3) = -1.0;
  Eigen::Matrix2d r, s;
  r << 0.25, 0.1, 0.1, 0.2;
  s = h * p * h.transpose() + r;
  const double z[] = {0.2, 1.1};
  const Eigen::Vector2d innovation(z[0] - (x(0) * x(2) - x(2)), z[1] - (x(1) * x(2) - x(3)));
  ASSERT_EQ((filter.Update<0, 1>(Difference(), z)), StaticOutcome::kAccepted);
  const Eigen::Matrix<double, 6, 2> k = p * h.transpose() * s.inverse();
  x += k * innovation;
  EXPECT_LT((filter.covariance() - (p - k * s * k.transpose())).norm(), 1e-14);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(filter.value<0>()[i], x(i), 1e-14);
    EXPECT_NEAR(filter.value<1>()[i], x(2 + i), 1e-14);
    EXPECT_NEAR(filter.value<2>()[i], x(4 + i), 1e-14);
  }
}

TEST(StaticEkf, WhatCannotBeUsedChangesNothing) {
  DepthEkf filter = StaticDepthFilter();
  const StereoDisparity stereo(400.0, 0.065, 1.0);
  const Eigen::Matrix3d p = filter.covariance();
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::nan(""), negative = -1.0, far = 1e6;
  EXPECT_EQ(filter.Update<kDepth>(stereo, &negative), StaticOutcome::kInvalid);
  EXPECT_EQ(filter.Update<kDepth>(stereo, &nan), StaticOutcome::kInvalid);
  EXPECT_EQ(filter.Update<kDepth>(stereo, &far, 10.0), StaticOutcome::kGated);
  EXPECT_EQ((filter.Update<kDepth, kInverseDistance>(Scale2d::FromSigma(infinity), &far)),
            StaticOutcome::kNotFinite);
  EXPECT_EQ(*filter.value<kDepth>(), 0.35);
  EXPECT_EQ(filter.covariance(), p);
  filter.Set<kDepth>(-0.35, 0.1);
  const double d = 70.0;
  EXPECT_EQ(filter.Update<kDepth>(stereo, &d), StaticOutcome::kOutOfDomain);
}

/// Motion model x' = 2 x + w, which overflows after some steps.
struct Doubling : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = 2.0 * x[0] + w[0];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

/// Measures z = x_1 with sigma 1. x has two elements.
struct First : Sensor<Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(1.0);
  }
};

TEST(StaticEkf, AStepToWhatIsNotFiniteIsAnErrorAndChangesNothing) {
  const double largest = std::numeric_limits<double>::max();
  StaticEkf<Doubling> filter{Doubling()};
  filter.Set<0>(0.75 * largest, 1.0);
  EXPECT_EQ(filter.Predict(1.0), Status::kError);  // x overflows
  EXPECT_EQ(*filter.value<0>(), 0.75 * largest);
  EXPECT_EQ(filter.covariance()(0, 0), 1.0);
  filter.Set<0>(3.0, 1.0);
  Eigen::Matrix<double, 1, 1> p;
  p(0) = 0.5 * largest;
  const double three = 3.0;
  filter.Set<0>(&three, p);
  EXPECT_EQ(filter.Predict(1.0), Status::kError);  // P becomes four times as large and overflows
  EXPECT_EQ(*filter.value<0>(), 3.0);
  EXPECT_EQ(filter.covariance(), p);
  filter.Set<0>(3.0, 1.0);
  EXPECT_EQ(filter.Predict(1.0), Status::kOk);
  EXPECT_EQ(*filter.value<0>(), 6.0);
}

// r = 1e150 and S = 2. The NIS of 5e299 is finite, but K r = 5e302 makes x_2 overflow.
TEST(StaticEkf, AnUpdateToWhatIsNotFiniteIsReportedAndChangesNothing) {
  const double largest = std::numeric_limits<double>::max();
  StaticEkf<Constant<2>> filter{Constant<2>(2)};
  Eigen::Matrix2d p;
  p << 1.0, 1e153, 1e153, 1e307;
  for (const double second : {largest, 0.0}) {
    const double x[] = {0.0, second}, z = 1e150;
    filter.Set<0>(x, p);
    if (second == 0.0) {
      EXPECT_EQ(filter.Update<0>(First(), &z), StaticOutcome::kAccepted);
      continue;
    }
    EXPECT_EQ(filter.Update<0>(First(), &z), StaticOutcome::kNotFinite);
    EXPECT_EQ(filter.value<0>()[0], 0.0);
    EXPECT_EQ(filter.value<0>()[1], largest);
    EXPECT_EQ(filter.covariance(), p);
  }
}

}  // namespace
}  // namespace alidade
