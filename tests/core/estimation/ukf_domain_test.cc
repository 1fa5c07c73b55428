// SPDX-License-Identifier: Apache-2.0
//
// Tests sigma points that lie outside the domain of a model.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

TEST(Ukf, PointsThatWouldLeaveTheDomainAreDrawnNearerAndThatIsSaid) {
  Problem problem = DepthFilter();
  problem.priors[0].covariance(0) = 1.0;  // 0.35 +- 1 m; sigma points reach 0.35 - 1.7 m
  UkfOptions options;
  options.alpha = 1.0;
  Ukf ukf(problem, options, StreamsOf(problem));
  const UpdateReport& first = ukf.Process(FrameAt(0.0, {{0, 80.0}, {1, 1.1}}));
  for (const MeasurementReport& entry : first.measurements()) {
    EXPECT_EQ(entry.outcome, Outcome::kAccepted);
    EXPECT_TRUE(std::isfinite(entry.nis));
  }
  EXPECT_TRUE(HasEvent(first, EventKind::kGuarded));
  EXPECT_FALSE(ukf.diverged());
  EXPECT_GT(ValueOf(ukf.state(), "target.depth"), 0.0);
  // The sigma points are now close enough to the estimate, so there is no event.
  for (int k = 1; k < 20; ++k) ukf.Process(FrameAt(0.0, {{0, 80.0}, {1, 1.1}}));
  EXPECT_FALSE(HasEvent(ukf.Process(FrameAt(0.0, {{0, 80.0}})), EventKind::kGuarded));
  EXPECT_NEAR(ValueOf(ukf.state(), "target.depth"), 26.0 / 80.0, 0.005);
  // Three seconds later the uncertainty is several metres, so the event is reported again.
  EXPECT_TRUE(HasEvent(ukf.Process(FrameAt(3.0, {{0, 80.0}})), EventKind::kGuarded));
}

/// Motion model of a constant 1. Any other value causes an exception.
struct Stubborn : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T*, double, T* next) const {
    if (!(x[0] == T(1.0))) throw std::runtime_error("only from 1");
    next[0] = x[0];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 0.1; }
};

TEST(Ukf, APluginThatFailsAtAPointIsSaidToFail) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Stubborn{}, "stubborn"), {{"x", 1.0, 0.5}});
  Ukf ukf(problem, {}, {});
  ukf.Start(0);
  const UpdateReport& report = ukf.Process(FrameAt(0.1, {}));
  EXPECT_TRUE(ukf.failed());
  ASSERT_TRUE(HasEvent(report, EventKind::kPluginFailed));
  EXPECT_NE(report.events.back().text.find("only from 1"), std::string::npos)
      << report.events.back().text;
}

/// Measures z = x + 5 + n. h is linear but defined only for x > 0.
struct Near : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    if (!(x[0] > T(0.0))) return false;
    z[0] = x[0] + 5.0;
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
};

Problem NearZero(double x) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", x, 0.1}});
  AddSensor(problem, "near", MakeSensor(Near{}, "near"), {"p.x"});
  return problem;
}

// In the last case the estimate is only 1e-3 sigma away from the edge of the domain. The sigma
// points are then 1e-3 sigma away from the estimate. For a linear h the moments equal those of the
// EKF at any spread. At the narrowest spread the rounding error is eps 5 / (2 c^2) = 6e-10.
TEST(Ukf, NarrowPointsKeepTheMomentsOfALinearSensor) {
  for (const double x : {0.05, 9e-4, 1e-4, 2e-5}) {
    const Problem problem = NearZero(x);
    Ekf ekf(problem, {}, StreamsOf(problem));
    UkfOptions options;
    options.alpha = 0.01;
    Ukf ukf(problem, options, StreamsOf(problem));
    const Frame frame = FrameAt(0.0, {{0, 5.02}});
    const UpdateReport &expected = ekf.Process(frame), &found = ukf.Process(frame);
    EXPECT_EQ(HasEvent(found, EventKind::kGuarded), x < 1e-3) << x;
    ASSERT_EQ(found.measurements()[0].outcome, Outcome::kAccepted) << x;
    EXPECT_NEAR(found.measurements()[0].h[0], expected.measurements()[0].h[0], 1e-7) << x;
    EXPECT_NEAR(found.measurements()[0].s[0], expected.measurements()[0].s[0], 1e-7) << x;
    EXPECT_NEAR(ValueOf(ukf.state(), "p.x"), ValueOf(ekf.state(), "p.x"), 1e-7) << x;
    EXPECT_NEAR(CovarianceOf(ukf.state(), "p.x", "p.x"), CovarianceOf(ekf.state(), "p.x", "p.x"),
                1e-7)
        << x;
  }
}

// If sigma points are this close to the estimate, their differences contain only rounding errors.
TEST(Ukf, PointsThatCannotBeDrawnNearEnoughLeaveTheMeasurementOut) {
  for (const double x : {1e-7, 3e-10}) {
    const Problem problem = NearZero(x);
    UkfOptions options;
    options.alpha = 0.01;
    Ukf ukf(problem, options, StreamsOf(problem));
    const UpdateReport& report = ukf.Process(FrameAt(0.0, {{0, 5.02}}));
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kOutOfDomain);
    EXPECT_TRUE(report.measurements()[0].h.empty());
    ASSERT_EQ(report.events.size(), 1u);
    EXPECT_EQ(report.events[0].kind, EventKind::kGuarded);
    EXPECT_EQ(report.events[0].text,
              "sensor 'near': sigma points are outside the domain or have no mean, even with the "
              "smallest spread; their spread is divided by 64");
    EXPECT_FALSE(ukf.diverged());
    EXPECT_EQ(ValueOf(ukf.state(), "p.x"), x);
    // The event is reported once.
    EXPECT_TRUE(ukf.Process(FrameAt(0.0, {{0, 5.02}})).events.empty());
  }
}

TEST(Ukf, ASpreadThatLosesAllDigitsIsRefused) {
  const Problem problem = NearZero(1.0);
  UkfOptions options;
  options.alpha = 1e-5;
  EXPECT_THROW(Ukf(problem, options, StreamsOf(problem)), Error);
}

TEST(Ukf, ASensorNotDefinedAtTheEstimateIsOutOfDomain) {
  Problem problem = DepthFilter();
  problem.priors[0].mean = {-0.2};
  Ukf ukf(problem, {}, StreamsOf(problem));
  const std::vector<double> before = ukf.state().values();
  const UpdateReport& report = ukf.Process(FrameAt(0.0, {{0, 80.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kOutOfDomain);
  EXPECT_TRUE(report.measurements()[0].h.empty());
  EXPECT_TRUE(HasEvent(report, EventKind::kDiverged));
  EXPECT_TRUE(ukf.diverged());
  EXPECT_EQ(ukf.state().values(), before);
}

}  // namespace
}  // namespace alidade
