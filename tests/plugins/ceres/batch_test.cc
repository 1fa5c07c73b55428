// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <cmath>

#include "alidade/check/plugin_listing.h"
#include "alidade/experiment/run.h"
#include "batch_fixture.h"
#include "plugins/depth_target/depth_target.h"
#include "support/manifold_models.h"

namespace alidade {
namespace {

using testing::AddMotion;
using testing::AddSensor;
using testing::FrameAt;
using testing::LinearSystem;
using testing::MakeBatch;
using testing::Shipped;

/// Results of a smoother: values and covariances of each frame, and the events of the last frame.
struct Smoothed {
  std::vector<Eigen::VectorXd> x;
  std::vector<Eigen::MatrixXd> p;
  std::vector<Event> events;
};

Eigen::VectorXd ValuesOf(const State& state) {
  return Eigen::Map<const Eigen::VectorXd>(state.values().data(), std::ssize(state.values()));
}

Smoothed SmoothOver(Estimator& batch, const std::vector<Frame>& frames) {
  for (const Frame& frame : frames) batch.Process(frame);
  Smoothed result;
  batch.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
    EXPECT_EQ(k, result.x.size());
    result.x.push_back(ValuesOf(state));
    result.p.push_back(state.covariance().Dense());
    result.events = report.events;
  });
  return result;
}

std::vector<Frame> LinearFrames(int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double t_s = 0.05 * k, wobble = 0.3 * std::sin(37.0 * k);
    frames.push_back(k % 4 == 3 ? FrameAt(t_s, {})  // no measurement
                                : FrameAt(t_s, {{0, 2.0 * std::cos(t_s) + wobble}}));
  }
  return frames;
}

/// One scalar measurement z = h x + n, n ~ N(0, r).
struct LinearRow {
  Eigen::RowVectorXd h;
  double z, r;
};

/// Computes a Kalman filter and a Rauch-Tung-Striebel smoother: P' = F P F' + Q, C = P F' P'^-1,
/// x_s = x + C (x_s' - x'), P_s = P + C (P_s' - P') C'. The first element is a position, and the
/// second element is its constant velocity. The other elements are constant.
Smoothed WrittenOut(Eigen::VectorXd x, Eigen::MatrixXd p, double acceleration,
                    const std::vector<Frame>& frames,
                    const std::vector<std::vector<LinearRow>>& rows) {
  const Eigen::Index n = x.size();
  std::vector<Eigen::VectorXd> predicted;
  std::vector<Eigen::MatrixXd> p_predicted, f_to;
  Smoothed result;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double dt = k == 0 ? 0.0 : Seconds(frames[k].timestamp - frames[k - 1].timestamp);
    Eigen::MatrixXd f = Eigen::MatrixXd::Identity(n, n);
    f(0, 1) = dt;
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
    g.head(2) << 0.5 * dt * dt, dt;
    x = f * x;
    p = f * p * f.transpose() + acceleration * acceleration * g * g.transpose();
    predicted.push_back(x);
    p_predicted.push_back(p);
    f_to.push_back(f);
    for (const LinearRow& row : rows[k]) {
      const Eigen::VectorXd gain =
          p * row.h.transpose() / ((row.h * p * row.h.transpose())(0) + row.r);
      x += gain * (row.z - row.h.dot(x));
      const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(n, n) - gain * row.h;
      p = rest * p * rest.transpose() + row.r * gain * gain.transpose();
    }
    result.x.push_back(x);
    result.p.push_back(p);
  }
  for (std::size_t k = frames.size() - 1; k-- > 0;) {
    const Eigen::MatrixXd c = result.p[k] * f_to[k + 1].transpose() * p_predicted[k + 1].inverse();
    result.x[k] += c * (result.x[k + 1] - predicted[k + 1]);
    result.p[k] += c * (result.p[k + 1] - p_predicted[k + 1]) * c.transpose();
  }
  return result;
}

void ExpectNear(const Smoothed& found, const Smoothed& expected, double tolerance) {
  ASSERT_EQ(found.x.size(), expected.x.size());
  for (std::size_t k = 0; k < found.x.size(); ++k) {
    EXPECT_LT((found.x[k] - expected.x[k]).cwiseAbs().maxCoeff(), tolerance) << k;
    EXPECT_LT((found.p[k] - expected.p[k]).cwiseAbs().maxCoeff(), tolerance) << k;
  }
}

// The process noise of the two elements has rank 1: G = (dt^2/2, dt).
TEST(CeresBatch, EqualsTheSmootherWrittenOutOnALinearProblem) {
  const std::vector<Frame> frames = LinearFrames(60);
  std::vector<std::vector<LinearRow>> rows(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    for (const Measurement& m : frames[k].measurements) {
      rows[k].push_back({Eigen::RowVector2d(2.0, 0.0), m.values[0], 0.09});
    }
  }
  const auto batch = MakeBatch(LinearSystem());
  const Smoothed found = SmoothOver(*batch, frames);
  ExpectNear(found,
             WrittenOut(Eigen::Vector2d(1.0, -0.5), Eigen::Vector2d(4.0, 9.0).asDiagonal(), 0.7,
                        frames, rows),
             1e-9);
  EXPECT_FALSE(batch->failed());
  ASSERT_EQ(found.events.size(), 1u);
  EXPECT_EQ(found.events[0].kind, EventKind::kSolution);
  EXPECT_NE(found.events[0].text.find("in 1 solve: converged"), std::string::npos)
      << found.events[0].text;
}

/// Returns frames of a target at the depth 0.3 + 0.1 sin(2.5 t) m. Most frames contain the
/// disparity of the target (BF = 26 px m), and all frames contain 1 / scale.
std::vector<Frame> DepthFrames(int count) {
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double t_s = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t_s);
    Frame frame = FrameAt(t_s, {{1, depth / 0.3 + 0.006 * std::sin(37.0 * k)}});
    if (k % 7 < 4)
      frame.measurements.push_back(
          {frame.timestamp, 0, -1, {26.0 / depth + std::cos(23.0 * k)}, {}});
    frames.push_back(frame);
  }
  return frames;
}

// The problem is linearised at the optimum, with R at the optimum. The smoother of this problem
// must return the optimum.
TEST(CeresBatch, IsAFixedPointOfTheLinearisedSmootherWithItsNoise) {
  const std::vector<Frame> frames = DepthFrames(60);
  const auto batch = MakeBatch(testing::DepthFilter());
  const Smoothed found = SmoothOver(*batch, frames);
  ASSERT_EQ(found.x.size(), frames.size());
  std::vector<std::vector<LinearRow>> rows(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Eigen::VectorXd& x = found.x[k];
    for (const Measurement& m : frames[k].measurements) {
      const double depth = x(0), lambda = x(2), z = m.values[0];
      Eigen::RowVector3d h(-26.0 / (depth * depth), 0.0, 0.0);
      double predicted = 26.0 / depth, sigma = 1.0;
      if (m.stream == 1) {
        h << lambda, 0.0, depth;
        predicted = lambda * depth;
        sigma = 2.0 / 300.0 * std::pow(predicted, 3);
      }
      rows[k].push_back({h, z - predicted + h.dot(x), sigma * sigma});
    }
  }
  ExpectNear(found,
             WrittenOut(Eigen::Vector3d(0.35, 0.0, 3.3),
                        Eigen::Vector3d(0.01, 0.25, 0.25).asDiagonal(), 1.0, frames, rows),
             1e-8);
}

TEST(CeresBatch, GivesTheSameBytesTwice) {
  const std::vector<Frame> frames = DepthFrames(60);
  const Smoothed one = SmoothOver(*MakeBatch(testing::DepthFilter()), frames);
  const Smoothed two = SmoothOver(*MakeBatch(testing::DepthFilter()), frames);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(one.x[k], two.x[k]);
    EXPECT_EQ(one.p[k], two.p[k]);
  }
  EXPECT_EQ(one.events.back().text, two.events.back().text);
}

TEST(CeresBatch, EndsWhereTheKalmanFilterDoes) {
  const Problem problem = LinearSystem();
  const std::vector<Frame> frames = LinearFrames(60);
  const Smoothed found = SmoothOver(*MakeBatch(problem), frames);
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  for (const Frame& frame : frames) ekf.Process(frame);
  EXPECT_LT((found.x.back() - ValuesOf(ekf.state())).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((found.p.back() - ekf.state().covariance().Dense()).cwiseAbs().maxCoeff(), 1e-9);
}

// In a linear system the full-information filter equals the Kalman filter at every frame.
TEST(CeresBatch, OfTheDataSoFarIsTheKalmanFilter) {
  const Problem problem = LinearSystem();
  const auto batch = MakeBatch(problem, "mode: filtering\n");
  EXPECT_FALSE(batch->offline());
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  for (const Frame& frame : LinearFrames(40)) {
    const UpdateReport& report = batch->Process(frame);
    EXPECT_EQ(report.measurements().size(), frame.measurements.size());
    ekf.Process(frame);
    EXPECT_LT((ValuesOf(batch->state()) - ValuesOf(ekf.state())).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((batch->state().covariance().Dense() - ekf.state().covariance().Dense())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9);
    EXPECT_EQ(batch->timestamp(), frame.timestamp);
  }
}

TEST(CeresBatch, StepsGapsInTheSamePartsAsTheFilter) {
  const Problem problem = LinearSystem();
  const auto expect_equal = [&](const std::vector<Frame>& frames, double max_dt_s) {
    const auto batch = MakeBatch(problem, "max_dt_s: " + std::to_string(max_dt_s));
    const Smoothed found = SmoothOver(*batch, frames);
    EkfOptions options;
    options.max_dt_s = max_dt_s;
    Ekf ekf(problem, options, testing::StreamsOf(problem));
    for (const Frame& frame : frames) ekf.Process(frame);
    EXPECT_LT((found.x.back() - ValuesOf(ekf.state())).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((found.p.back() - ekf.state().covariance().Dense()).cwiseAbs().maxCoeff(), 1e-9);
  };
  std::vector<Frame> frames = LinearFrames(20);
  frames.push_back(FrameAt(1.7, {{0, 0.4}}));
  expect_equal(frames, 0.04);
  // In double precision 0.3 / 0.1 is more than 3.
  expect_equal({FrameAt(0.0, {{0, 2.1}}), FrameAt(0.3, {{0, 0.4}})}, 0.1);
}

// The third frame initialises p.x. The Kalman filter has the same initial value and correlations.
TEST(CeresBatch, ABlockMayStartFromAMeasurement) {
  Problem problem = LinearSystem();
  problem.priors[0].sensor = "z";
  std::vector<Frame> frames = LinearFrames(30);
  frames[0].measurements.clear();
  frames[1].measurements.clear();
  const auto batch = MakeBatch(problem), so_far = MakeBatch(problem, "mode: filtering\n");
  const BlockId x = problem.layout.Find("p.x");
  Ekf ekf(problem, {}, testing::StreamsOf(problem));
  const auto expect_equal = [&](const State& found, const State& expected, std::size_t k) {
    ASSERT_EQ(found.layout()[x].present, k >= 2);
    for (const char* block : {"p.v", "p.x"}) {
      if (k < 2 && std::string(block) == "p.x") continue;
      EXPECT_NEAR(testing::ValueOf(found, block), testing::ValueOf(expected, block), 1e-9) << k;
      EXPECT_NEAR(testing::CovarianceOf(found, block, "p.v"),
                  testing::CovarianceOf(expected, block, "p.v"), 1e-9)
          << k;
    }
  };
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const UpdateReport& report = so_far->Process(frames[k]);
    ekf.Process(frames[k]);
    batch->Process(frames[k]);
    if (k == 2) {
      EXPECT_EQ(report.measurements()[0].outcome, Outcome::kInitialised);
    }
    expect_equal(so_far->state(), ekf.state(), k);
  }
  std::size_t emitted = 0;
  batch->Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    EXPECT_EQ(state.layout()[x].present, k >= 2);
    if (++emitted == frames.size()) expect_equal(state, ekf.state(), k);
  });
  EXPECT_EQ(emitted, frames.size());
}

// An exactly known block stays constant. A block is known exactly if it is fixed, or if it has zero
// sigma and no process noise.
TEST(CeresBatch, WhatIsKnownStays) {
  Problem zero = LinearSystem();
  zero.priors[1].covariance.setZero();
  zero.motions[0].model = MakeMotion(ConstantVelocity<1, false>(0.0), "constant_velocity");
  const std::vector<Frame> frames = LinearFrames(30);
  const Smoothed known = SmoothOver(*MakeBatch(zero), frames);
  EXPECT_DOUBLE_EQ(known.x.back()(1), -0.5);
  EXPECT_DOUBLE_EQ(known.p.back()(1, 1), 0.0);

  const Problem moving = LinearSystem();
  const SharedMotion& model = moving.motions[0].model;
  Problem fixed;
  MotionBinding binding{"p", model, {}};
  binding.blocks = {fixed.layout.Declare("p.x", "p", model->blocks()[0]),
                    fixed.layout.Declare("p.v", "p", model->blocks()[1], BlockStatus::kConstant)};
  fixed.motions = {binding};
  fixed.priors = moving.priors;
  AddSensor(fixed, "z", moving.sensors[0].model, {"p.x"});
  const Smoothed held = SmoothOver(*MakeBatch(fixed), frames);
  Ekf ekf(fixed, {}, testing::StreamsOf(fixed));
  for (const Frame& frame : frames) ekf.Process(frame);
  ASSERT_EQ(held.x.size(), frames.size());
  EXPECT_EQ(held.x.back()(1), -0.5);
  EXPECT_LT((held.x.back() - ValuesOf(ekf.state())).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(held.p.back()(0, 0), ekf.state().covariance().Variance(0), 1e-9);
}

// ---- manifolds ----------------------------------------------------------------------------------

/// Model of a constant value on a manifold.
template <class G>
struct Still : Motion<0, G> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  bool Stationary() const { return true; }
  template <class T>
  void Step(const T* x, const T*, double, T* next) const {
    std::copy_n(x, G::kAmbient, next);
  }
  void SqrtQ(double, MatrixRef) const {}
};

/// Expects that the derivative of |x (-) m|^2 / 0.25 + sum |z (-) x|^2 / 0.16 vanishes at the
/// estimate x.
template <class G>
void ExpectStationary(const Geometry& geometry) {
  const std::vector<double> mean = geometry.Identity();
  std::vector<double> x(G::kAmbient);
  Problem problem;
  const SharedMotion still = MakeMotion(Still<G>(), "still");
  const BlockId id = problem.layout.Declare("p.x", "p", still->blocks()[0]);
  problem.motions.push_back({"p", still, {id}});
  const int t = geometry.tangent;
  problem.priors.push_back({id, mean, 0.25 * Eigen::MatrixXd::Identity(t, t), ""});
  AddSensor(problem, "z", MakeSensor(testing::ManifoldSensor<G, 0.4>(), "direct"), {"p.x"});
  std::vector<Frame> frames;
  for (int k = 0; k < 3; ++k) {  // values far from the mean and from each other
    const double d[3] = {0.9 + 0.4 * k, -0.5 * k, 0.3};
    Measurement m{TimestampFromSeconds(k), 0, -1, std::vector<double>(G::kAmbient), {}};
    geometry.Plus(mean.data(), d, m.values.data());
    frames.push_back({m.timestamp, {m}});
  }
  const Smoothed found = SmoothOver(*MakeBatch(problem), frames);
  ASSERT_EQ(found.x.size(), 3u);
  std::copy_n(found.x[0].data(), G::kAmbient, x.data());
  EXPECT_NEAR(DistanceFrom(geometry, x.data()), 0.0, 1e-12);
  const auto cost = [&](int i, double step) {
    double d[3] = {}, moved[4], residual[3];
    d[i] = step;
    geometry.Plus(x.data(), d, moved);
    geometry.Minus(moved, mean.data(), residual);
    double sum = Eigen::Map<Eigen::VectorXd>(residual, t).squaredNorm() / 0.25;
    for (const Frame& frame : frames) {
      geometry.Minus(frame.measurements[0].values.data(), moved, residual);
      sum += Eigen::Map<Eigen::VectorXd>(residual, t).squaredNorm() / 0.16;
    }
    return sum;
  };
  // Ceres stops if the cost, which is 20, falls by less than 1e-14 of its value. Then 45 d^2 / 2 =
  // 2e-13, so the gradient is 45 d = 4e-6. The last step removes most of this gradient. Central
  // differences have an error of 2e-9.
  for (int i = 0; i < t; ++i) EXPECT_NEAR((cost(i, 1e-5) - cost(i, -1e-5)) / 2e-5, 0.0, 1e-6);
}

TEST(CeresBatch, IsAtTheOptimumOnManifolds) {
  ExpectStationary<UnitQuaternion>(Geometry::UnitQuaternion());
  ExpectStationary<UnitVector>(Geometry::UnitVector());
  ExpectStationary<Angle>(Geometry::Angle());
}

}  // namespace
}  // namespace alidade
