// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/square_root_ekf.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "alidade/base/random.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Kalman filter of MovingPoint(0.7) with one direct measurement, computed with the inverse of S.
struct DirectTextbook {
  Eigen::Vector2d x{1.0, -0.5};
  Eigen::Matrix2d p = Eigen::Vector2d(4.0, 9.0).asDiagonal();
  void Step(double dt) {
    const Eigen::Matrix2d f = (Eigen::Matrix2d() << 1.0, dt, 0.0, 1.0).finished();
    const Eigen::Vector2d g = 0.7 * Eigen::Vector2d(0.5 * dt * dt, dt);
    x = f * x;
    p = f * p * f.transpose() + g * g.transpose();
  }
  void Update(double z, double sigma) {
    const Eigen::Vector2d k = p.col(0) / (p(0, 0) + sigma * sigma);
    x += k * (z - x[0]);
    p = p - k * p.row(0).eval();
  }
};

TEST(SquareRootEkf, EqualsTheClosedFormKalmanFilterOnALinearProblem) {
  Problem problem = MovingPoint(0.7);
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  SquareRootEkf filter(problem, {}, StreamsOf(problem));
  filter.Start(0);
  DirectTextbook textbook;
  Random random(21);
  for (int k = 1; k <= 300; ++k) {
    const double z = random.Normal();
    textbook.Step(0.04);
    if (k % 4 != 0) textbook.Update(z, 0.3);
    const UpdateReport& report =
        filter.Process(k % 4 != 0 ? FrameAt(0.04 * k, {{0, z}}) : FrameAt(0.04 * k, {}));
    ASSERT_NEAR(ValueOf(filter.state(), "p.x"), textbook.x[0], 1e-9) << k;
    ASSERT_NEAR(ValueOf(filter.state(), "p.v"), textbook.x[1], 1e-9) << k;
    ASSERT_LT((filter.state().covariance().Dense() - textbook.p).norm(), 1e-9) << k;
    ASSERT_LT((filter.root() * filter.root().transpose() - textbook.p).norm(), 1e-9) << k;
    if (k % 4 == 0) continue;
    const MeasurementReport& entry = report.measurements()[0];
    ASSERT_NEAR(entry.gain[0] * 0.09, textbook.p(0, 0), 1e-9) << k;  // K = P+ H' R^-1
  }
}

TEST(SquareRootEkf, EqualsTheEkfOnTheDepthFilterInEveryOrderOfUpdates) {
  const Problem problem = DepthFilter();
  for (const Fuse fuse : {Fuse::kJoint, Fuse::kPerSensor, Fuse::kPerMeasurement}) {
    EkfOptions options;
    options.fuse = fuse;
    options.gate = 0.999;
    options.rejection_recovery = RejectionRecovery::kNone;
    options.max_dt_s = 0.02;
    SquareRootEkf filter(problem, options, StreamsOf(problem));
    Ekf ekf(problem, options, StreamsOf(problem));
    Random random(22);
    for (int k = 0; k < 150; ++k) {
      const double depth = 0.3 + 0.1 * std::sin(0.08 * k);
      const double d = k % 40 == 30 ? 500.0 : 26.0 / depth + random.Normal();
      const Frame frame = FrameAt(0.033 * k, {{0, d}, {1, depth / 0.3 + 0.01 * random.Normal()}});
      const UpdateReport &ours = filter.Process(frame), &theirs = ekf.Process(frame);
      for (std::size_t i = 0; i < 2; ++i) {
        ASSERT_EQ(ours.measurements()[i].outcome, theirs.measurements()[i].outcome);
        ASSERT_NEAR(ours.measurements()[i].nis, theirs.measurements()[i].nis,
                    1e-9 * (1.0 + theirs.measurements()[i].nis));
      }
      ASSERT_LT((filter.state().covariance().Dense() - ekf.state().covariance().Dense()).norm(),
                1e-9);
      ASSERT_NEAR(ValueOf(filter.state(), "target.depth"), ValueOf(ekf.state(), "target.depth"),
                  1e-9);
    }
  }
}

// Two constants have wide priors. Then x + y and x + (1 + 1e-3) y are measured with sigma 1e-7. The
// smallest variance is at most 1e-16 of the largest prior variance, so it is below the rounding
// error of P.
TEST(SquareRootEkf, StaysPositiveDefiniteWhereTheDifferenceOfCovariancesDoesNot) {
  constexpr double kPrior = 1e3, kSigma = 1e-7;
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, kPrior}});
  AddMotion(problem, "q", testing::ConstantMotion(1), {{"x", 0.0, kPrior}});
  AddSensor(problem, "sum", SumSensor(1.0, 1.0, kSigma), {"p.x", "q.x"});
  AddSensor(problem, "nearly", SumSensor(1.0, 1.001, kSigma), {"p.x", "q.x"});
  SquareRootEkf filter(problem, {}, StreamsOf(problem));

  const Eigen::RowVector2d sum(1.0, 1.0), nearly(1.0, 1.001);
  Eigen::Matrix2d difference = Eigen::Vector2d(kPrior * kPrior, kPrior * kPrior).asDiagonal();
  bool lost = false;
  for (int k = 0; k < 4; ++k) {
    const Eigen::RowVector2d& h = k % 2 == 0 ? sum : nearly;
    const double z = h[0] * 3.0 + h[1] * 5.0;
    const UpdateReport& report = filter.Process(FrameAt(0.0, {{k % 2, z}}));
    ASSERT_EQ(report.measurements()[0].outcome, Outcome::kAccepted) << k;
    const Eigen::Vector2d w =
        difference * h.transpose() / std::sqrt(h * difference * h.transpose() + kSigma * kSigma);
    difference -= w * w.transpose();
    lost = lost || !(difference.determinant() > 0.0);
  }
  EXPECT_TRUE(lost);
  // The information form is exact to rounding: P^-1 = P0^-1 + sum H' R^-1 H.
  const Eigen::Matrix2d information =
      Eigen::Matrix2d::Identity() / (kPrior * kPrior) +
      2.0 / (kSigma * kSigma) * (sum.transpose() * sum + nearly.transpose() * nearly);
  const Eigen::Matrix2d expected = information.inverse();
  const Eigen::Matrix2d p = filter.root() * filter.root().transpose();
  EXPECT_GT(filter.root().determinant() * filter.root().determinant(), 0.0);
  EXPECT_LT((p - expected).norm(), 1e-3 * expected.norm());
  EXPECT_NEAR(std::abs(filter.root().determinant()), std::sqrt(expected.determinant()),
              1e-3 * std::sqrt(expected.determinant()));
  EXPECT_NEAR(ValueOf(filter.state(), "p.x"), 3.0, 1e-3);
}

TEST(SquareRootEkf, ASingularPriorStaysSingular) {
  Problem problem = MovingPoint(0.0);
  problem.priors[1].covariance.setZero();
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  SquareRootEkf filter(problem, {}, StreamsOf(problem));
  filter.Start(0);
  for (int k = 1; k <= 20; ++k) filter.Process(FrameAt(0.1 * k, {{0, 1.0}}));
  EXPECT_EQ(CovarianceOf(filter.state(), "p.v", "p.v"), 0.0);
  EXPECT_EQ(ValueOf(filter.state(), "p.v"), -0.5);
  EXPECT_NEAR(CovarianceOf(filter.state(), "p.x", "p.x"), 1.0 / (1.0 / 4.0 + 20.0 / 0.09), 1e-12);
}

}  // namespace
}  // namespace alidade
