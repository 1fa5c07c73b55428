// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rts.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

#include "alidade/base/random.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Least squares over the first state and all noise inputs, which also works if Q is singular:
/// x_k = Phi_k x_0 + sum Gamma w, z_k = H x_k + n.
struct DenseBatch {
  std::vector<Eigen::MatrixXd> map;  ///< each x_k as a linear function of the unknowns
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  DenseBatch(int frames, int n) {
    const int size = n + frames - 1;
    normal = Eigen::MatrixXd::Zero(size, size);
    right = Eigen::VectorXd::Zero(size);
    // Prior of the noise inputs: w ~ N(0, 1).
    normal.bottomRightCorner(frames - 1, frames - 1).setIdentity();
    map.push_back(Eigen::MatrixXd::Identity(n, size));
  }
  void Step(const Eigen::MatrixXd& f, const Eigen::VectorXd& g) {
    Eigen::MatrixXd next = f * map.back();
    next.col(f.rows() + static_cast<Eigen::Index>(map.size()) - 1) += g;
    map.push_back(next);
  }
  void Measure(const Eigen::RowVectorXd& h, double z, double sigma) {
    const Eigen::RowVectorXd row = h * map.back() / sigma;
    normal += row.transpose() * row;
    right += row.transpose() * z / sigma;
  }
};

TEST(RtsSmoother, EqualsTheBatchLeastSquaresSolutionWithSingularProcessNoise) {
  constexpr int kFrames = 80;
  Problem problem = MovingPoint(0.7);
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  AddSensor(problem, "doubled", LinearSensor(2.0, 0.7), {"p.x"});
  EkfOptions per_sensor;
  per_sensor.fuse = Fuse::kPerSensor;
  RtsSmoother joint(problem, {}, StreamsOf(problem)),
      apart(problem, per_sensor, StreamsOf(problem));
  DenseBatch batch(kFrames, 2);
  batch.normal.topLeftCorner<2, 2>() = Eigen::Vector2d(1.0 / 4.0, 1.0 / 9.0).asDiagonal();
  batch.right.head<2>() = Eigen::Vector2d(1.0 / 4.0, -0.5 / 9.0);
  Random random(5);
  for (int k = 0; k < kFrames; ++k) {
    const double dt = 0.04;
    Frame frame = FrameAt(dt * k, {});
    if (k > 0) {
      batch.Step((Eigen::Matrix2d() << 1.0, dt, 0.0, 1.0).finished(),
                 0.7 * Eigen::Vector2d(0.5 * dt * dt, dt));
    }
    const double z0 = random.Normal(), z1 = random.Normal();
    if (k % 3 != 2) batch.Measure(Eigen::RowVector2d(1.0, 0.0), z0, 0.3);
    if (k % 5 == 0) batch.Measure(Eigen::RowVector2d(2.0, 0.0), z1, 0.7);
    if (k % 3 != 2) frame.measurements.push_back({frame.timestamp, 0, -1, {z0}, {}});
    if (k % 5 == 0) frame.measurements.push_back({frame.timestamp, 1, -1, {z1}, {}});
    joint.Process(frame);
    apart.Process(frame);
  }
  const Eigen::MatrixXd covariance = batch.normal.inverse();
  const Eigen::VectorXd solution = batch.normal.fullPivLu().solve(batch.right);
  for (RtsSmoother* rts : {&joint, &apart}) {
    std::size_t count = 0;
    rts->Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
      ASSERT_EQ(k, count++);
      const Eigen::Vector2d x = batch.map[k] * solution;
      const Eigen::Matrix2d p = batch.map[k] * covariance * batch.map[k].transpose();
      EXPECT_NEAR(ValueOf(state, "p.x"), x[0], 1e-9) << k;
      EXPECT_NEAR(ValueOf(state, "p.v"), x[1], 1e-9) << k;
      EXPECT_LT((state.covariance().Dense() - p).norm(), 1e-9) << k;
      EXPECT_EQ(report.measurements().size(), (k % 3 != 2 ? 1u : 0u) + (k % 5 == 0 ? 1u : 0u));
    });
    EXPECT_EQ(count, static_cast<std::size_t>(kFrames));
  }
}

// The prior is vague, and the measurements are precise, so P decreases by up to 20 orders of
// magnitude. The smoothed sigmas must equal those of the information matrix, which does not lose
// digits, because its prior information is almost zero.
TEST(RtsSmoother, KeepsItsDigitsUnderAVaguePrior) {
  constexpr int kFrames = 20;
  for (const double prior_sigma : {1e2, 1e5, 1e8}) {
    Problem problem = MovingPoint(0.7);
    for (Prior& prior : problem.priors) prior.covariance *= 0.0;
    for (Prior& prior : problem.priors) prior.covariance(0, 0) = prior_sigma * prior_sigma;
    AddSensor(problem, "direct", LinearSensor(1.0, 0.01), {"p.x"});
    RtsSmoother rts(problem, {}, StreamsOf(problem));
    DenseBatch batch(kFrames, 2);
    batch.normal.topLeftCorner<2, 2>().diagonal().setConstant(1.0 / (prior_sigma * prior_sigma));
    for (int k = 0; k < kFrames; ++k) {
      const double dt = 0.04;
      if (k > 0) {
        batch.Step((Eigen::Matrix2d() << 1.0, dt, 0.0, 1.0).finished(),
                   0.7 * Eigen::Vector2d(0.5 * dt * dt, dt));
      }
      batch.Measure(Eigen::RowVector2d(1.0, 0.0), 1.0, 0.01);
      rts.Process(FrameAt(dt * k, {{0, 1.0}}));
    }
    const Eigen::MatrixXd covariance = batch.normal.inverse();
    rts.Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
      const Eigen::Matrix2d p = batch.map[k] * covariance * batch.map[k].transpose();
      EXPECT_NEAR(CovarianceOf(state, "p.x", "p.x") / p(0, 0), 1.0, 1e-4)
          << prior_sigma << ' ' << k;
      EXPECT_NEAR(CovarianceOf(state, "p.v", "p.v") / p(1, 1), 1.0, 1e-4)
          << prior_sigma << ' ' << k;
    });
  }
}

TEST(RtsSmoother, GapsInPartsAndTheGateAreThoseOfTheFilter) {
  Problem problem = MovingPoint();
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  EkfOptions options;
  options.gate = 0.999;
  options.max_dt_s = 0.1;
  RtsSmoother rts(problem, options, StreamsOf(problem));
  Ekf ekf(problem, options, StreamsOf(problem));
  const std::vector<Frame> frames = {FrameAt(0.0, {{0, 1.0}}), FrameAt(0.35, {{0, 0.8}}),
                                     FrameAt(0.4, {{0, 1e6}}), FrameAt(1.0, {{0, 0.5}})};
  for (const Frame& frame : frames) {
    rts.Process(frame);
    ekf.Process(frame);
  }
  std::vector<double> sigma;
  rts.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
    sigma.push_back(CovarianceOf(state, "p.x", "p.x"));
    EXPECT_EQ(report.measurements()[0].outcome, k == 2 ? Outcome::kGated : Outcome::kAccepted);
    if (k + 1 < frames.size()) return;
    // There are no data after the last frame.
    EXPECT_NEAR(ValueOf(state, "p.x"), ValueOf(ekf.state(), "p.x"), 1e-14);
    EXPECT_NEAR(ValueOf(state, "p.v"), ValueOf(ekf.state(), "p.v"), 1e-14);
    EXPECT_LT((state.covariance().Dense() - ekf.state().covariance().Dense()).norm(), 1e-14);
  });
  ASSERT_EQ(sigma.size(), frames.size());
  EXPECT_LT(sigma[0], 0.09);  // this sigma is smaller than that of the measurement alone
  // The second smoother processes the steps of the first smoother as frames without measurements: 4
  // for 0.35 s, and 6 for 0.6 s.
  options.max_dt_s = std::numeric_limits<double>::infinity();
  RtsSmoother in_frames(problem, options, StreamsOf(problem));
  std::vector<double> of_frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Timestamp last = i == 0 ? 0 : frames[i - 1].timestamp, gap = frames[i].timestamp - last;
    const int parts = std::array{1, 4, 1, 6}[i];
    for (int k = 1; k < parts; ++k) in_frames.Process(FrameAt(Seconds(last + gap * k / parts), {}));
    in_frames.Process(frames[i]);
  }
  in_frames.Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
    if (!report.measurements().empty()) of_frames.push_back(CovarianceOf(state, "p.x", "p.x"));
  });
  ASSERT_EQ(of_frames.size(), sigma.size());
  for (std::size_t i = 0; i < sigma.size(); ++i) EXPECT_NEAR(sigma[i], of_frames[i], 1e-9) << i;
}

// The depth filter is not linear. The expected values come from the recursion of Rauch, Tung and
// Striebel:
// x_s = x + C (x_s+ - x-), P_s = P + C (P_s+ - P-) C', C = P F' P-^-1.
// The recursion needs the inverse of P-, which the adjoint form avoids.
TEST(RtsSmoother, EqualsTheRecursionOfRauchTungAndStriebelOnTheDepthFilter) {
  const Problem problem = DepthFilter();
  EkfOptions options;
  options.gate = 0.999;
  options.rejection_recovery = RejectionRecovery::kNone;
  RtsSmoother rts(problem, options, StreamsOf(problem));
  Ekf ekf(problem, options, StreamsOf(problem));
  struct Pass {
    Eigen::Vector3d predicted, x;
    Eigen::Matrix3d p_predicted, p;
  };
  const auto values = [&] { return Eigen::Vector3d(ekf.state().values().data()); };
  std::vector<Pass> passes;
  Random random(6);
  constexpr int kFrames = 60;
  for (int k = 0; k < kFrames; ++k) {
    const double depth = 0.3 + 0.1 * std::sin(2.5 * 0.033 * k);
    const double d = k == 20 ? 500.0 : 26.0 / depth + random.Normal();
    const Frame frame = FrameAt(0.033 * k, {{0, d}, {1, depth / 0.3 + 0.01 * random.Normal()}});
    rts.Process(frame);
    ekf.Process(FrameAt(0.033 * k, {}));
    const Eigen::Vector3d predicted = values();
    const Eigen::Matrix3d p_predicted = ekf.state().covariance().Dense();
    ekf.Process(frame);
    passes.push_back({predicted, values(), p_predicted, ekf.state().covariance().Dense()});
  }
  for (int k = kFrames - 2; k >= 0; --k) {
    Pass& pass = passes[static_cast<std::size_t>(k)];
    const Pass& next = passes[static_cast<std::size_t>(k) + 1];
    Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
    f(0, 1) = 0.033;
    const Eigen::Matrix3d c = pass.p * f.transpose() * next.p_predicted.inverse();
    pass.x += c * (next.x - next.predicted);
    pass.p += c * (next.p - next.p_predicted) * c.transpose();
  }
  rts.Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    EXPECT_LT((Eigen::Vector3d(state.values().data()) - passes[k].x).norm(), 1e-9) << k;
    EXPECT_LT((state.covariance().Dense() - passes[k].p).norm(), 1e-9) << k;
  });
}

TEST(RtsSmoother, HasNothingToGoBackTo) {
  const Problem problem = DepthFilter();
  EXPECT_EQ(RtsSmoother(problem, {}, StreamsOf(problem)).Clone(), nullptr);
}

TEST(RtsSmoother, AllBlocksMayBeConstant) {
  const Problem problem = WithStatus(DepthFilter(), "", BlockStatus::kConstant);
  RtsSmoother smoother(problem, {}, StreamsOf(problem));
  for (int k = 0; k < 3; ++k) smoother.Process(FrameAt(0.1 * k, {{0, 80.0}}));
  int frames = 0;
  smoother.Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
    EXPECT_NEAR(ValueOf(state, "target.depth"), problem.priors[0].mean[0], 0.2);
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
    ++frames;
  });
  EXPECT_EQ(frames, 3);
}

TEST(RtsSmoother, IsNotMadeWithConsideredOrWaitingBlocks) {
  Problem considered = DepthFilter();
  const BlockId id = considered.layout.Find("template.inverse_distance");
  StateLayout layout;
  for (const Block& b : considered.layout.blocks()) {
    layout.Declare(b.name, b.owner, b.space,
                   b.name == considered.layout[id].name ? BlockStatus::kConsider : b.status);
  }
  considered.layout = layout;
  EXPECT_THROW(RtsSmoother(considered, {}, StreamsOf(considered)), Error);
  Problem waiting = DepthFilter();
  waiting.priors[0].sensor = "disparity";
  EXPECT_THROW(RtsSmoother(waiting, {}, StreamsOf(waiting)), Error);
}

}  // namespace
}  // namespace alidade
