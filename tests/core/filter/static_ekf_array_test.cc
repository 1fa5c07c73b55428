// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/static_ekf_array.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "alidade/base/random.h"
#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"

namespace alidade {
namespace {

/// A heading, and a turn rate that is seen with it: an angle, a vector, a measurement of both with
/// correlated noise, and a function that is not polynomial.
struct HeadingStep : Motion<1, Angle, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"heading", "rad"}, Quantity{"rate", "rad/s"}};
  template <class T>
  void Step(const T* heading, const T* rate, const T* w, double dt_s, T* next, T* next_rate) const {
    Angle::Plus(heading, std::array<T, 1>{dt_s * rate[0]}.data(), next);
    next_rate[0] = rate[0] + w[0];
  }
  void SqrtQ(double dt_s, MatrixRef l) const { l(0, 0) = 0.3 * std::sqrt(dt_s); }
};
struct Gyrocompass : Sensor<Product<Angle, Vec<2>>, Angle, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"heading", "rad"}, Quantity{"rate", "rad/s"}};
  static constexpr Quantity kMeasurement{"z"};
  static constexpr std::array kParts{Quantity{"heading", "rad"}, Quantity{"waves", "", "", "a,b"}};
  template <class T>
  bool Predict(const T* heading, const T* rate, T* z) const {
    using std::cos;
    using std::exp;
    using std::sin;
    z[0] = heading[0];
    z[1] = sin(heading[0]) + 0.1 * exp(rate[0]);
    z[2] = cos(heading[0]) * rate[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.1);
    l[3] = T(0.05);
    l[4] = T(0.2);
    l[7] = T(-0.1);
    l[8] = T(0.3);
  }
  /// No template: asked of one filter after the other.
  bool Valid(const double* z) const { return z[1] > -1.0; }
};

/// The lanes that this processor runs.
std::vector<int> AllLanes() {
  std::vector<int> all;
  for (const int lanes : {2, 4, 16}) {
    if (internal::HasLanes(lanes)) all.push_back(lanes);
  }
  return all;
}

/// Relative to the largest number of the second.
template <class Matrix>
double RelativeDifference(const Matrix& a, const Matrix& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

template <class Array, class Single>
void ExpectSameFilter(const Array& array, int i, const Single& single) {
  const auto compare = [&](auto b) {
    for (int e = 0; e < Single::template Space<b>::kAmbient; ++e) {
      const double expected = single.template value<b>()[e];
      ASSERT_NEAR(array.template value<b>(i, e), expected, 1e-12 * (1.0 + std::abs(expected)))
          << "filter " << i << ", block " << b;
    }
  };
  detail::ForEach(compare, std::make_index_sequence<Single::kBlocks>{});
  ASSERT_LT(RelativeDifference(array.covariance(i), single.covariance()), 1e-12) << i;
}

using VelocityOfDepth = ConstantVelocity<1, false>;
using DepthArray = StaticEkfArray<VelocityOfDepth, Constant<1>>;
using DepthSingle = StaticEkf<VelocityOfDepth, Constant<1>>;

/// A depth filter of each kind, at slightly different values.
template <class Filter, class... Index>
void SetDepth(Filter& filter, double depth, Index... index) {
  filter.template Set<0>(index..., depth, 0.1);
  filter.template Set<1>(index..., 0.0, 0.5);
  filter.template Set<2>(index..., 3.3, 0.5);
}

/// Steps filters one by one and as an array, over 60 frames, by `dt_of` (frame, filter).
template <class DtOf>
void ExpectSameDepths(int count, int lanes, double walk, const DtOf& dt_of) {
  const StereoDisparity stereo(400.0, 0.065, 1.0, 0.1);
  const Scale2d scale = Scale2d::FromPixels(300.0, 1.0);
  DepthArray array(count, VelocityOfDepth(1.0), Constant<1>(1, walk));
  array.set_lanes(lanes);
  std::vector<DepthSingle> singles;
  for (int i = 0; i < count; ++i) {
    singles.emplace_back(VelocityOfDepth(1.0), Constant<1>(1, walk));
    // Filter 5 begins behind the camera: no sensor is defined there.
    const double depth = i == 5 ? -0.3 : 0.3 + 0.002 * i;
    SetDepth(singles.back(), depth);
    SetDepth(array, depth, i);
  }
  Random random(3);
  const auto n = static_cast<std::size_t>(count);
  const std::unique_ptr<bool[]> seen(new bool[n]);
  int counts[5] = {};
  for (int frame = 0; frame < 60; ++frame) {
    std::vector<double> disparity(n), inverse_scale(n), dt_s(n);
    std::vector<StaticOutcome> of_disparity(n), of_scale(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double depth = 0.3 + 0.05 * std::sin(0.08 * frame + 0.1 * static_cast<double>(i));
      disparity[i] = 26.0 / depth + random.Normal();
      if (random.Uniform() < 0.1) disparity[i] = -1.0;   // blind
      if (random.Uniform() < 0.1) disparity[i] += 60.0;  // far off
      if (random.Uniform() < 0.05) disparity[i] = std::nan("");
      inverse_scale[i] = depth / 0.3 + 0.005 * random.Normal();
      seen[i] = random.Uniform() < 0.8;
      dt_s[i] = dt_of(frame, static_cast<int>(i));
    }
    const ArrayUpdate<StereoDisparity, 0> by_stereo{stereo, disparity.data(), 10.0, nullptr,
                                                    of_disparity.data()};
    const ArrayUpdate<Scale2d, 0, 2> by_scale{scale, inverse_scale.data(), 10.0, seen.get(),
                                              of_scale.data()};
    EXPECT_EQ(array.Step(dt_s.data(), by_stereo, by_scale), 0);
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      ASSERT_EQ(singles[k].Predict(dt_s[k]), Status::kOk);
      const StaticOutcome first = singles[k].Update<0>(stereo, &disparity[k], 10.0);
      ASSERT_EQ(of_disparity[k], first) << i << ", frame " << frame;
      ++counts[static_cast<int>(first)];
      const StaticOutcome second = seen[k] ? singles[k].Update<0, 2>(scale, &inverse_scale[k], 10.0)
                                           : StaticOutcome::kInvalid;
      ASSERT_EQ(of_scale[k], second) << i << ", frame " << frame;
      ASSERT_NO_FATAL_FAILURE(ExpectSameFilter(array, i, singles[k]));
    }
  }
  for (const StaticOutcome outcome :
       {StaticOutcome::kAccepted, StaticOutcome::kGated, StaticOutcome::kInvalid}) {
    EXPECT_GT(counts[static_cast<int>(outcome)], 20);
  }
  if (count > 5) {
    EXPECT_GT(counts[static_cast<int>(StaticOutcome::kOutOfDomain)], 20);
  }
}

TEST(StaticEkfArray, EachIsTheSingleFilter) {
  for (const int lanes : AllLanes()) {
    for (const int count : {37, 4}) {
      SCOPED_TRACE(::testing::Message() << lanes << " lanes, " << count << " filters");
      ExpectSameDepths(count, lanes, 0.0, [](int, int) { return 0.033; });
      ExpectSameDepths(count, lanes, 0.2, [](int frame, int) { return 0.01 + 0.001 * frame; });
    }
  }
}

TEST(StaticEkfArray, StepsEachByATimeOfItsOwn) {
  for (const int lanes : AllLanes()) {
    ExpectSameDepths(21, lanes, 0.1,
                     [](int frame, int i) { return 0.02 + 1e-3 * ((frame + i) % 5); });
  }
}

TEST(StaticEkfArray, HasAnglesAndMeasurementsOfSeveralNumbers) {
  constexpr int kCount = 19;
  const Gyrocompass sensor;
  for (const int lanes : AllLanes()) {
    StaticEkfArray<HeadingStep> array(kCount, HeadingStep());
    array.set_lanes(lanes);
    std::vector<StaticEkf<HeadingStep>> singles;
    for (int i = 0; i < kCount; ++i) singles.emplace_back(HeadingStep());
    for (int i = 0; i < kCount; ++i) {
      const double heading = 3.0 - 0.05 * i;
      singles[static_cast<std::size_t>(i)].Set<0>(heading, 0.3);
      singles[static_cast<std::size_t>(i)].Set<1>(0.5, 0.2);
      array.Set<0>(i, heading, 0.3);
      array.Set<1>(i, 0.5, 0.2);
    }
    Random random(7);
    int gated = 0, wrapped = 0, invalid = 0;
    for (int frame = 0; frame < 40; ++frame) {
      std::vector<double> z(3 * kCount);
      std::vector<StaticOutcome> outcomes(kCount);
      for (std::size_t i = 0; i < kCount; ++i) {
        const double heading = 3.0 - 0.05 * static_cast<double>(i) + 0.05 * frame;
        z[i] = Angle::Wrap(heading + 0.1 * random.Normal());
        z[kCount + i] = std::sin(heading) + 0.1 * std::exp(0.5) + 0.2 * random.Normal();
        z[2 * kCount + i] = 0.5 * std::cos(heading) + 0.3 * random.Normal();
      }
      array.Step(0.1);
      array.Update(ArrayUpdate<Gyrocompass, 0, 1>{sensor, z.data(), 6.0, nullptr, outcomes.data()});
      for (std::size_t i = 0; i < kCount; ++i) {
        ASSERT_EQ(singles[i].Predict(0.1), Status::kOk);
        const double own[] = {z[i], z[kCount + i], z[2 * kCount + i]};
        ASSERT_EQ(outcomes[i], (singles[i].Update<0, 1>(sensor, own, 6.0)));
        invalid += outcomes[i] == StaticOutcome::kInvalid ? 1 : 0;
        gated += outcomes[i] == StaticOutcome::kGated ? 1 : 0;
        wrapped += *singles[i].value<0>() < -1.0 ? 1 : 0;
        ASSERT_NO_FATAL_FAILURE(ExpectSameFilter(array, static_cast<int>(i), singles[i]));
      }
    }
    EXPECT_GT(gated, 10);
    EXPECT_GT(wrapped, 10);
    EXPECT_GT(invalid, 5);
  }
}

/// x' = 2 x + w: overflows in the end. Not defined from 100 to 200.
struct DoublingStep : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  bool Step(const T* x, const T* w, double, T* next) const {
    if (x[0] > T(100.0) && x[0] < T(200.0)) return false;
    next[0] = 2.0 * x[0] + w[0];
    return true;
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TEST(StaticEkfArray, WhatGoesWrongInOneFilterIsItsOwnAffair) {
  const double largest = std::numeric_limits<double>::max();
  for (const int lanes : AllLanes()) {
    StaticEkfArray<DoublingStep> array(11, DoublingStep());
    array.set_lanes(lanes);
    for (int i = 0; i < 11; ++i) array.Set<0>(i, i == 3 ? 0.75 * largest : i == 8 ? 150.0 : i, 1.0);
    const double five = 5.0;
    const Eigen::Matrix<double, 1, 1> large(0.75 * largest);  // 4 P + 1 is beyond what is finite
    array.Set<0>(5, &five, large);
    EXPECT_EQ(array.Step(1.0), 3);
    for (int i = 0; i < 11; ++i) {
      const bool stuck = i == 3 || i == 5 || i == 8;
      EXPECT_EQ(array.status(i), i == 3 || i == 5 ? Status::kError
                                 : i == 8         ? Status::kOutOfDomain
                                                  : Status::kOk);
      EXPECT_EQ(array.value<0>(i), i == 3 ? 0.75 * largest : i == 8 ? 150.0 : stuck ? i : 2.0 * i);
      EXPECT_EQ(array.covariance(i)(0, 0), i == 5 ? large(0, 0) : stuck ? 1.0 : 5.0);
    }
    // The next prediction says nothing of this one.
    array.Set<0>(3, 1.0, 1.0);
    array.Set<0>(8, 1.0, 1.0);
    array.Set<0>(5, 1.0, 1.0);
    EXPECT_EQ(array.Step(1.0), 0);
    EXPECT_EQ(array.status(3), Status::kOk);
    EXPECT_EQ(array.status(8), Status::kOk);
  }
}

TEST(StaticEkfArray, AnInnovationCovarianceThatIsNotFiniteChangesNothing) {
  const Scale2d scale = Scale2d::FromSigma(std::numeric_limits<double>::infinity());
  const double z[] = {1.0, 1.0, 1.0};
  for (const int lanes : AllLanes()) {
    DepthArray array(3, VelocityOfDepth(1.0), Constant<1>(1));
    array.set_lanes(lanes);
    for (int i = 0; i < 3; ++i) SetDepth(array, 0.3, i);
    StaticOutcome outcomes[3];
    array.Update(ArrayUpdate<Scale2d, 0, 2>{scale, z, 10.0, nullptr, outcomes});
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(outcomes[i], StaticOutcome::kNotFinite);
      EXPECT_EQ(array.value<0>(i), 0.3);
      EXPECT_EQ(array.covariance(i)(0, 0), 0.1 * 0.1);
    }
  }
}

/// A covariance that is none, as no filter arrives at.
TEST(StaticEkfArray, AnInnovationCovarianceThatIsNotPositiveIsRefusedOfThatFilterAlone) {
  const Scale2d scale = Scale2d::FromSigma(0.1);
  const std::vector<double> z(20, 1.0);
  for (const int lanes : AllLanes()) {
    DepthArray array(20, VelocityOfDepth(1.0), Constant<1>(1));
    array.set_lanes(lanes);
    for (int i = 0; i < 20; ++i) SetDepth(array, 0.3, i);
    const Eigen::Matrix<double, 1, 1> negative(-1.0);
    const double depth = 0.3;
    array.Set<0>(4, &depth, negative);
    std::vector<StaticOutcome> outcomes(20);
    array.Update(ArrayUpdate<Scale2d, 0, 2>{scale, z.data(), 1e6, nullptr, outcomes.data()});
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(outcomes[static_cast<std::size_t>(i)],
                i == 4 ? StaticOutcome::kNotFinite : StaticOutcome::kAccepted)
          << i;
      EXPECT_EQ(array.value<0>(i) == 0.3, i == 4) << i;
    }
  }
}

TEST(StaticEkfArray, ACovarianceOfSeveralNumbersThatIsNotPositiveIsRefusedLikewise) {
  const Gyrocompass sensor;
  const std::vector<double> z(3 * 20, 0.1);
  for (const int lanes : AllLanes()) {
    StaticEkfArray<HeadingStep> array(20, HeadingStep());
    array.set_lanes(lanes);
    for (int i = 0; i < 20; ++i) {
      array.Set<0>(i, 0.1, 0.3);
      array.Set<1>(i, 0.2, 0.2);
    }
    const double heading = 0.1;
    const Eigen::Matrix<double, 1, 1> negative(-1.0);
    array.Set<0>(13, &heading, negative);
    StaticOutcome outcomes[20];
    array.Update(ArrayUpdate<Gyrocompass, 0, 1>{sensor, z.data(), 1e6, nullptr, outcomes});
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(outcomes[i], i == 13 ? StaticOutcome::kNotFinite : StaticOutcome::kAccepted) << i;
      EXPECT_EQ(array.covariance(i)(0, 0) == -1.0, i == 13) << i;
    }
  }
}

TEST(StaticEkfArray, NoGateLetsAllThroughAndOneOfZeroNone) {
  const Scale2d scale = Scale2d::FromSigma(0.1);
  std::vector<double> z(20, 1.2);
  z[7] = std::numeric_limits<double>::quiet_NaN();  // where there is none
  bool present[20];
  std::fill_n(present, 20, true);
  present[7] = false;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const int lanes : AllLanes()) {
    for (const double gate : {infinity, 0.0}) {
      DepthArray array(20, VelocityOfDepth(1.0), Constant<1>(1));
      array.set_lanes(lanes);
      for (int i = 0; i < 20; ++i) SetDepth(array, 0.3, i);
      StaticOutcome outcomes[20];
      array.Update(ArrayUpdate<Scale2d, 0, 2>{scale, z.data(), gate, present, outcomes});
      for (int i = 0; i < 20; ++i) {
        EXPECT_EQ(outcomes[i], i == 7        ? StaticOutcome::kInvalid
                               : gate == 0.0 ? StaticOutcome::kGated
                                             : StaticOutcome::kAccepted);
        EXPECT_EQ(array.value<0>(i) == 0.3, i == 7 || gate == 0.0);
      }
    }
  }
}

TEST(StaticEkfArray, RefusesLanesThatTheProcessorHasNot) {
  DepthArray array(3, VelocityOfDepth(1.0), Constant<1>(1));
  EXPECT_ANY_THROW(array.set_lanes(3));
}

}  // namespace
}  // namespace alidade
