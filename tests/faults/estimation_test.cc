// SPDX-License-Identifier: Apache-2.0
//
// Tests filters whose covariance becomes invalid. The comment above each test contains the number
// of the fault.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/iekf.h"
#include "support/recording.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Measures z = x0 - x1 + n.
struct Difference : Sensor<Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  double sigma;
  explicit Difference(double s) : sigma(s) {}
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0] - x[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(sigma);
  }
};

/// Returns a problem with two elements x of covariance P, and a sensor that measures their
/// difference.
Problem TwoElements(const Eigen::Matrix2d& p, double sigma) {
  Problem problem;
  MotionBinding binding{"p", testing::ConstantMotion(2), {}};
  binding.blocks.push_back(problem.layout.Declare("p.x", "p", binding.model->blocks()[0]));
  Prior prior;
  prior.block = 0;
  prior.mean = {1.0, 2.0};
  prior.covariance = p;
  problem.priors.push_back(prior);
  problem.motions.push_back(binding);
  AddSensor(problem, "difference", MakeSensor(Difference(sigma), "difference"), {"p.x"});
  return problem;
}

/// Returns a matrix P with the eigenvalues 2.1 and -0.1, for which S = 1 - 2.2 + 1 + 0.01 < 0.
Eigen::Matrix2d Indefinite() { return (Eigen::Matrix2d() << 1.0, 1.1, 1.1, 1.0).finished(); }

// Tests fault 75 of tests/faults/README.md.
TEST(LostPositiveDefiniteness, IsRepairedReportedAndTheFilterGoesOn) {
  const Problem problem = TwoElements(Indefinite(), 0.1);
  for (const bool iterated : {false, true}) {
    std::unique_ptr<Filter> filter =
        std::make_unique<Ekf>(problem, EkfOptions{}, StreamsOf(problem));
    if (iterated) filter = std::make_unique<Iekf>(problem, IekfOptions{}, StreamsOf(problem));
    const UpdateReport& report = filter->Process(FrameAt(0.0, {{0, -1.0}}));
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotPd);
    EXPECT_TRUE(HasEvent(report, EventKind::kRepaired));
    EXPECT_EQ(filter->state().values(), (std::vector<double>{1.0, 2.0}));
    // The factors of P are l = 1.1 and the pivots 1 and -0.21. The repair sets the negative pivot
    // to zero and retains the other factors.
    const Eigen::MatrixXd p = filter->state().covariance().Dense();
    const Eigen::Matrix2d expected = (Eigen::Matrix2d() << 1.0, 1.1, 1.1, 1.21).finished();
    EXPECT_TRUE(p.isApprox(expected, 1e-12)) << p;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(p);
    EXPECT_GE(eigen.eigenvalues().minCoeff(), -1e-12);
    const UpdateReport& next = filter->Process(FrameAt(0.0, {{0, -1.0}}));
    EXPECT_EQ(next.measurements()[0].outcome, Outcome::kAccepted);
    EXPECT_FALSE(HasEvent(next, EventKind::kRepaired));
    EXPECT_FALSE(filter->failed());
  }
}

/// An EKF that gives the test access to P.
struct Open : Ekf {
  using Ekf::Ekf;
  using Ekf::engine;
};

// Tests fault 75 of tests/faults/README.md: the number of repairs is limited.
TEST(LostPositiveDefiniteness, EndsTheFilterOnceItsRepairsAreUsedUp) {
  const Problem problem = TwoElements(Indefinite(), 0.1);
  EkfOptions options;
  options.max_covariance_repairs = 3;
  Open ekf(problem, options, StreamsOf(problem));
  for (int k = 0; k <= options.max_covariance_repairs; ++k) {
    const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, -1.0}}));
    EXPECT_EQ(HasEvent(report, EventKind::kRepaired), k < options.max_covariance_repairs) << k;
    EXPECT_EQ(ekf.failed(), k == options.max_covariance_repairs) << k;
    // Makes P indefinite again.
    ekf.engine().f.state.covariance().SetBlock(0, 0, Indefinite());
  }
}

// Tests fault 75 of tests/faults/README.md: a repair that is undone by a rollback, as for a late
// frame, is not counted.
TEST(LostPositiveDefiniteness, WhatIsTakenBackIsNotCounted) {
  const Problem problem = TwoElements(Indefinite(), 0.1);
  EkfOptions options;
  options.max_covariance_repairs = 1;
  Ekf ekf(problem, options, StreamsOf(problem));
  const Ekf before = ekf;
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(HasEvent(ekf.Process(FrameAt(0.0, {{0, -1.0}})), EventKind::kRepaired)) << k;
    EXPECT_FALSE(ekf.failed());
    ekf = before;
  }
}

// Tests fault 75 of tests/faults/README.md: the exit code is 79, and the other estimators continue.
TEST(LostPositiveDefiniteness, BeyondItsRepairsIsExitCode79) {
  Experiment experiment = MakeExperiment();
  EstimatorSpec named;
  named.name = "indefinite";
  named.problem = TwoElements(Indefinite(), 0.1);
  named.problem.sensors[0].stream = "inverse_scale";
  EkfOptions options;
  options.max_covariance_repairs = 0;
  named.estimator = std::make_unique<Ekf>(named.problem, options, experiment.source->streams());
  experiment.estimators.push_back(std::move(named));
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kDiverged);
  EXPECT_NE(result.reason.find("estimator 'indefinite' at t = 0.000000 s: the covariance is not "
                               "positive semi-definite"),
            std::string::npos)
      << result.reason;
  EXPECT_NE(result.reason.find("the limit of repairs is 0; last good state"), std::string::npos)
      << result.reason;
  EXPECT_EQ(result.frames, 60);
  EXPECT_TRUE(result.estimators.back().diverged);
  EXPECT_FALSE(result.estimators.front().diverged);
}

// Tests fault 79 of tests/faults/README.md: S = H P H' + R = 0, although P is valid.
TEST(SingularInnovation, IsReportedAndChangesNothing) {
  const Eigen::Matrix2d ones = Eigen::Matrix2d::Ones();  // x0 - x1 is known exactly
  const Problem problem = TwoElements(ones, 0.0);
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, -0.5}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotPd);
  ASSERT_TRUE(HasEvent(report, EventKind::kNotPd));
  const auto event = std::ranges::find(report.events, EventKind::kNotPd, &Event::kind);
  EXPECT_EQ(event->text, "sensor 'difference': S is not positive definite");
  EXPECT_FALSE(HasEvent(report, EventKind::kRepaired)) << "P is valid and needs no repair";
  EXPECT_EQ(ekf.state().values(), (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(ekf.state().covariance().Dense(), Eigen::MatrixXd(ones));
  EXPECT_FALSE(ekf.failed());
  EXPECT_FALSE(ekf.diverged());
}

// Tests fault 79 of tests/faults/README.md: two measurements are equal and have no noise. For each
// measurement alone, S is regular.
TEST(SingularInnovation, OfTwoStackedMeasurementsRollsBoth) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 1.0, 2.0}});
  AddSensor(problem, "one", LinearSensor(1.0, 0.0), {"p.x"});
  AddSensor(problem, "two", LinearSensor(1.0, 0.0), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 3.0}, {1, 4.0}}));
  for (const MeasurementReport& entry : report.measurements()) {
    EXPECT_EQ(entry.outcome, Outcome::kNotPd);
  }
  EXPECT_TRUE(HasEvent(report, EventKind::kNotPd));
  EXPECT_EQ(ValueOf(ekf.state(), "p.x"), 1.0);
  EXPECT_EQ(CovarianceOf(ekf.state(), "p.x", "p.x"), 4.0);
  EXPECT_FALSE(ekf.failed());
}

}  // namespace
}  // namespace alidade
