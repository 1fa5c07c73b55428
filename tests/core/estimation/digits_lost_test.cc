// SPDX-License-Identifier: Apache-2.0
//
// Tests which estimators keep the digits of P if priors are vague and measurements are accurate,
// and that the event `digits_lost` marks the other estimators.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr double kSensorSigma = 1e-3;
constexpr int kSums = 40, kDirect = 30;

/// Returns a problem of two constants with vague priors. Their sum and the first one are measured.
Problem TwoConstants(double prior) {
  Problem problem;
  AddMotion(problem, "a", testing::ConstantMotion(1), {{"x", 0.0, prior}});
  AddMotion(problem, "b", testing::ConstantMotion(1), {{"x", 0.0, prior}});
  AddSensor(problem, "sum", SumSensor(1.0, 1.0, kSensorSigma), {"a.x", "b.x"});
  AddSensor(problem, "direct", LinearSensor(1.0, kSensorSigma), {"a.x"});
  return problem;
}

struct Outcomes {
  double error;  ///< largest relative error of the final sigmas
  int marks;     ///< number of events `digits_lost`
};

/// Processes 40 sums, the last 30 of them with a direct measurement. With negligible prior
/// information, the final variances are sigma^2 / 30 for a, and sigma^2 / 40 + sigma^2 / 30 for b.
Outcomes Process(Estimator& estimator) {
  Outcomes outcomes{0.0, 0};
  for (int k = 0; k < kSums; ++k) {
    const UpdateReport& report =
        estimator.Process(k < kSums - kDirect ? FrameAt(0.1 * k, {{0, 3.0}})
                                              : FrameAt(0.1 * k, {{0, 3.0}, {1, 1.0}}));
    for (const Event& event : report.events) {
      outcomes.marks += event.kind == EventKind::kDigitsLost ? 1 : 0;
    }
  }
  const double a = 1.0 / kDirect, b = a + 1.0 / kSums;
  for (const auto& [name, exact] : {std::pair{"a.x", a}, std::pair{"b.x", b}}) {
    const double found =
        CovarianceOf(estimator.state(), name, name) / (kSensorSigma * kSensorSigma);
    outcomes.error = std::max(outcomes.error, std::abs(std::sqrt(found / exact) - 1.0));
  }
  return outcomes;
}

std::vector<std::unique_ptr<Estimator>> FiltersThatStoreP(const Problem& problem) {
  std::vector<std::unique_ptr<Estimator>> filters;
  filters.push_back(std::make_unique<Ekf>(problem, EkfOptions{}, StreamsOf(problem)));
  filters.push_back(std::make_unique<Iekf>(problem, IekfOptions{}, StreamsOf(problem)));
  filters.push_back(std::make_unique<Ukf>(problem, UkfOptions{}, StreamsOf(problem)));
  return filters;
}

// A ratio of 1e5 between the sigmas of prior and measurement loses 10 of 16 digits.
TEST(DigitsLost, ARatioOfSigmasUpTo1e5IsRightAndNotMarked) {
  for (const double prior : {1.0, 10.0, 100.0}) {
    for (const std::unique_ptr<Estimator>& filter : FiltersThatStoreP(TwoConstants(prior))) {
      const Outcomes outcomes = Process(*filter);
      EXPECT_LT(outcomes.error, 1e-3) << prior;
      EXPECT_EQ(outcomes.marks, 0) << prior;
    }
  }
}

TEST(DigitsLost, AFilterThatStoresPIsRightOrMarkedOnceForEachSensor) {
  for (double prior = 1e3; prior < 2e9; prior *= 10.0) {
    for (const std::unique_ptr<Estimator>& filter : FiltersThatStoreP(TwoConstants(prior))) {
      const Outcomes outcomes = Process(*filter);
      EXPECT_TRUE(outcomes.error < 0.01 || outcomes.marks > 0) << prior << ' ' << outcomes.error;
      EXPECT_LE(outcomes.marks, 2) << prior;
    }
  }
}

TEST(DigitsLost, AFilterThatStoresARootIsRightAndNotMarked) {
  for (double prior = 1e2; prior < 2e9; prior *= 10.0) {
    const Problem problem = TwoConstants(prior);
    SquareRootEkf filter(problem, {}, StreamsOf(problem));
    RtsSmoother smoother(problem, {}, StreamsOf(problem));
    for (Estimator* estimator : std::initializer_list<Estimator*>{&filter, &smoother}) {
      const Outcomes outcomes = Process(*estimator);
      EXPECT_LT(outcomes.error, 1e-4) << prior;
      EXPECT_EQ(outcomes.marks, 0) << prior;
    }
  }
}

// All data determine the constants equally in every frame. The exact variances are those of the
// inverse of the information matrix, without differences of large numbers. L has an error of a few
// units in the last digit of its largest element, so the relative error of a sigma is proportional
// to the ratio of the sigmas of prior and measurement: 1e-6 for a ratio of 1e9.
TEST(DigitsLost, TheSmootherIsRightInEveryFrame) {
  constexpr double kWeight = 1.0 / (kSensorSigma * kSensorSigma), kSum = kSums * kWeight,
                   kFirst = kDirect * kWeight;
  for (double ratio = 1e2; ratio < 2e9; ratio *= 10.0) {
    const double prior = ratio * kSensorSigma, given = 1.0 / (prior * prior),
                 tolerance = 1e-15 * ratio;
    const Problem problem = TwoConstants(prior);
    RtsSmoother smoother(problem, {}, StreamsOf(problem));
    Process(smoother);
    const double determinant = given * (given + 2.0 * kSum + kFirst) + kSum * kFirst;
    const double a = (given + kSum) / determinant, b = (given + kSum + kFirst) / determinant;
    smoother.Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
      const double found_a = CovarianceOf(state, "a.x", "a.x");
      const double found_b = CovarianceOf(state, "b.x", "b.x");
      EXPECT_NEAR(std::sqrt(found_a / a), 1.0, tolerance) << ratio << ' ' << k;
      EXPECT_NEAR(std::sqrt(found_b / b), 1.0, tolerance) << ratio << ' ' << k;
    });
  }
}

// The Joseph form keeps the digits of a variance that one direct measurement reduces.
TEST(DigitsLost, ADirectMeasurementIsNotMarked) {
  Problem problem;
  AddMotion(problem, "a", testing::ConstantMotion(1), {{"x", 0.0, 1e9}});
  AddSensor(problem, "direct", LinearSensor(1.0, kSensorSigma), {"a.x"});
  for (const std::unique_ptr<Estimator>& filter : FiltersThatStoreP(problem)) {
    const UpdateReport& report = filter->Process(FrameAt(0.0, {{0, 1.0}}));
    EXPECT_FALSE(HasEvent(report, EventKind::kDigitsLost));
    EXPECT_NEAR(std::sqrt(CovarianceOf(filter->state(), "a.x", "a.x")) / kSensorSigma, 1.0, 1e-3);
  }
}

// Two sensors measure the same state in a joint update. The second pivot of S is 2 sigma^2 = 2e-6,
// computed as a difference of variances of 1e8.
TEST(DigitsLost, APivotThatAJointUpdateLosesIsMarked) {
  Problem problem;
  AddMotion(problem, "a", testing::ConstantMotion(1), {{"x", 0.0, 1e4}});
  AddSensor(problem, "first", LinearSensor(1.0, kSensorSigma), {"a.x"});
  AddSensor(problem, "second", LinearSensor(1.0, kSensorSigma), {"a.x"});
  EkfOptions options;
  options.fuse = Fuse::kJoint;
  Ekf joint(problem, options, StreamsOf(problem));
  const Frame frame = FrameAt(0.0, {{0, 1.0}, {1, 1.0}});
  EXPECT_TRUE(HasEvent(joint.Process(frame), EventKind::kDigitsLost));
  options.fuse = Fuse::kPerMeasurement;
  Ekf sequential(problem, options, StreamsOf(problem));
  EXPECT_FALSE(HasEvent(sequential.Process(frame), EventKind::kDigitsLost));
}

TEST(DigitsLost, TheTextNamesTheSensorAndARemedy) {
  const Problem problem = TwoConstants(1e6);
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 3.0}}));
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].text,
            "sensor 'sum': the variance 1e-06 of a measurement is lost by rounding, because the "
            "states contribute variances of 1e+12; sigmas may be wrong by more than 1 %; use "
            "square_root_ekf or a narrower prior");
}

}  // namespace
}  // namespace alidade
