// SPDX-License-Identifier: Apache-2.0
//
// The batch of runs with landmarks, against least squares written out in the states themselves.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "ceres_batch_fixture.h"
#include "scene_fixture.h"
#include "support/landmark_models.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::InverseDepthPixels;
using testing::MapSystem;
using testing::Offset;
using testing::Sighting;
using testing::Sights;

/// What a batch says of a run: the camera frame by frame, the map, the events.
struct Found {
  std::vector<State> states;
  std::vector<LandmarkEstimate> map;
  std::vector<Event> events;
  bool failed = false;

  Vector3d Camera(std::size_t k) const {
    const State& state = states[k];
    return Eigen::Map<const Vector3d>(state.value(state.layout().Find("cam.position")));
  }
  const LandmarkEstimate& Landmark(std::int64_t id) const {
    return *std::ranges::find(map, id, &LandmarkEstimate::id);
  }
  /// The number behind `cost` in the event of the solve.
  double Cost() const { return std::stod(events.back().text.substr(5)); }
};

Found Solve(Estimator& batch, const std::vector<Frame>& frames) {
  Found found;
  for (const Frame& frame : frames) batch.Process(frame);
  batch.Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
    found.states.push_back(state);
    found.events.insert(found.events.end(), report.events.begin(), report.events.end());
  });
  found.map = batch.landmarks();
  found.failed = batch.failed();
  return found;
}
Found Solve(const System& system, const std::vector<Frame>& frames,
            const std::string& options = "") {
  return Solve(*testing::MakeBatch(system, options), frames);
}

/// Offsets to points, some of them known to 0.2 m; the first position of the camera to 0.3 m.
TEST(CeresBatchLandmarks, ALinearMapIsThatOfLeastSquaresOverAllSteps) {
  constexpr int kSteps = 12, kPoints = 6, kSize = 3 * (kSteps + kPoints);
  constexpr double kNoise = 0.05, kStart = 0.3, kKnown = 0.2;
  const double step = 0.1 * std::sqrt(0.1);
  Random random(7);
  const auto vector = [&](double sigma) {
    return Vector3d(sigma * random.Normal(), sigma * random.Normal(), sigma * random.Normal());
  };
  MatrixXd information = MatrixXd::Zero(kSize, kSize);
  VectorXd right = VectorXd::Zero(kSize);
  const auto add = [&](int a, int b, const Vector3d& difference, double sigma) {  // x_b - x_a
    const double w = 1.0 / (sigma * sigma);
    for (int e = 0; e < 3; ++e) {
      const Eigen::Index i = 3 * a + e, j = 3 * b + e;
      information(j, j) += w;
      right(j) += w * difference[e];
      if (a < 0) continue;
      information(i, i) += w;
      information(i, j) -= w;
      information(j, i) -= w;
      right(i) -= w * difference[e];
    }
  };
  LandmarkOptions options;
  std::vector<Vector3d> points;
  for (int i = 0; i < kPoints; ++i) points.push_back(vector(1.0));
  for (int i = 0; i < 2; ++i) {
    const Vector3d told = points[static_cast<std::size_t>(i)] + vector(kKnown);
    options.known.push_back({i, {told[0], told[1], told[2]}, kKnown});
    add(-1, kSteps + i, told, kKnown);
  }
  add(-1, 0, Vector3d::Zero(), kStart);
  std::vector<Frame> frames;
  Vector3d r = vector(kStart);
  for (int k = 0; k < kSteps; ++k, r += vector(step)) {
    if (k > 0) add(k - 1, k, Vector3d::Zero(), step);
    std::vector<Sighting> sights;
    for (int i = 0; i < kPoints; ++i) {
      if ((k + 2 * i) % 5 >= 3 || k < i / 2) continue;
      const Vector3d z = points[static_cast<std::size_t>(i)] - r + vector(kNoise);
      sights.push_back({i, {z[0], z[1], z[2]}});
      add(k, kSteps + i, z, kNoise);
    }
    frames.push_back(Sights(0.1 * k, sights));
  }
  const Found found = Solve(MapSystem(Offset(kNoise), options, kStart), frames);
  const MatrixXd covariance = information.inverse();
  const VectorXd solution = covariance * right;
  ASSERT_EQ(found.states.size(), std::size_t{kSteps});
  for (int k = 0; k < kSteps; ++k) {
    const auto at = static_cast<std::size_t>(k);
    EXPECT_LT((found.Camera(at) - solution.segment<3>(3 * k)).norm(), 1e-9) << k;
    const MatrixXd p = found.states[at].covariance().Dense();
    EXPECT_LT((p - covariance.block<3, 3>(3 * k, 3 * k)).norm(), 1e-9) << k;
  }
  ASSERT_EQ(found.map.size(), std::size_t{kPoints});
  for (int i = 0; i < kPoints; ++i) {
    const int at = 3 * (kSteps + i);
    EXPECT_LT((found.Landmark(i).position - solution.segment<3>(at)).norm(), 1e-9) << i;
    EXPECT_LT((found.Landmark(i).covariance - covariance.block<3, 3>(at, at)).norm(), 1e-9) << i;
  }
}

// The problem without its landmarks, of which there are none here, against that of all residuals.
TEST(CeresBatchLandmarks, WithoutAnyTheSolutionIsThatOfTheProblemWithoutThem) {
  const auto expect_equal = [](const System& system, const std::vector<Frame>& frames,
                               double tolerance) {
    System with = system;
    with.landmarks = LandmarkOptions{};
    const Found found = Solve(with, frames), expected = Solve(system, frames);
    ASSERT_FALSE(found.failed) << found.events.back().text;
    EXPECT_NEAR(found.Cost(), expected.Cost(), 1e-8 * expected.Cost());
    ASSERT_EQ(found.states.size(), expected.states.size());
    for (std::size_t k = 0; k < found.states.size(); ++k) {
      const MatrixXd p = expected.states[k].covariance().Dense();
      for (Eigen::Index i = 0; i < p.rows(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        EXPECT_NEAR(found.states[k].values()[at], expected.states[k].values()[at],
                    tolerance * std::sqrt(p(i, i)));
      }
      EXPECT_LT((found.states[k].covariance().Dense() - p).norm(), tolerance * p.norm()) << k;
    }
  };
  std::vector<Frame> point, depth;
  for (int k = 0; k < 60; ++k) {
    const double t_s = 0.05 * k, z = 0.3 + 0.1 * std::sin(2.5 * t_s);
    point.push_back(testing::FrameAt(t_s, {{0, 2.0 * std::cos(t_s) + 0.3 * std::sin(37.0 * k)}}));
    depth.push_back(testing::FrameAt(
        t_s, {{0, 26.0 / z + std::cos(23.0 * k)}, {1, z / 0.3 + 0.006 * std::sin(37.0 * k)}}));
  }
  expect_equal(testing::LinearSystem(), point, 1e-9);
  System robust = testing::DepthFilter();
  expect_equal(robust, depth, 1e-6);  // the noise that depends on the state settles to 1e-9
  robust.sensors[0].loss = {LossKind::kHuber, 1.0};
  expect_equal(robust, depth, 1e-5);  // steps of 1e-6 sigma are small enough
}

// ---- inverse depth ------------------------------------------------------------------------------

constexpr double kPixel = 0.004, kRho = 0.5, kRhoSigma = 0.15, kWalk = 0.1, kDt = 0.1;

/// A camera that walks before points, and what it sees of them: the problem of MapSystem in its
/// positions r_1.. and the points p_0.., all of them 3 numbers, side by side in one vector x.
struct Problem {
  int steps, points;
  std::vector<Frame> frames;
  VectorXd truth;
  RobustLoss loss;

  Problem(int of_steps, int of_points, int outlier_every = 0) : steps(of_steps), points(of_points) {
    Random random(11);
    truth.setZero(3 * (steps - 1 + points));
    for (int k = 1; k < steps; ++k) {
      for (int e = 0; e < 3; ++e) {
        truth[3 * (k - 1) + e] = Camera(truth, k - 1)[e] +
                                 kWalk * std::sqrt(kDt) * random.Normal() + (e == 0 ? 0.02 : 0);
      }
    }
    for (int i = 0; i < points; ++i) {
      truth.segment<3>(3 * (steps - 1 + i)) =
          Vector3d(0.5 * random.Normal(), 0.5 * random.Normal(), 1.7 + 0.2 * (i % 5));
    }
    int count = 0;
    for (int k = 0; k < steps; ++k) {
      std::vector<Sighting> sights;
      for (int i = 0; i < points; ++i) {
        if (k < i / 3 || (k + i) % 7 == 0) continue;
        Vector2d z = Pixel(truth, k, i) + kPixel * Vector2d(random.Normal(), random.Normal());
        if (outlier_every > 0 && ++count % outlier_every == 0) z[0] += 0.1;
        sights.push_back({i, {z[0], z[1]}});
      }
      frames.push_back(Sights(kDt * k, sights));
    }
  }
  Vector3d Camera(const VectorXd& x, int k) const {
    return k == 0 ? Vector3d::Zero() : Vector3d(x.segment<3>(3 * (k - 1)));
  }
  Vector3d Point(const VectorXd& x, std::int64_t i) const {
    return x.segment<3>(3 * (steps - 1 + i));
  }
  Vector2d Pixel(const VectorXd& x, int k, std::int64_t i) const {
    return (Point(x, i) - Camera(x, k)).hnormalized();
  }
  /// All residuals over their sigma, and after which of them a sight of two ends.
  VectorXd Residuals(const VectorXd& x, std::vector<Eigen::Index>* sights = nullptr) const {
    std::vector<double> r;
    for (int k = 1; k < steps; ++k) {
      const Vector3d w = (Camera(x, k) - Camera(x, k - 1)) / (kWalk * std::sqrt(kDt));
      r.insert(r.end(), {w[0], w[1], w[2]});
    }
    std::vector<bool> seen(static_cast<std::size_t>(points), false);
    for (int k = 0; k < steps; ++k) {
      for (const Measurement& m : frames[static_cast<std::size_t>(k)].measurements) {
        const Vector2d d = Vector2d(m.values[0], m.values[1]) - Pixel(x, k, m.landmark);
        r.insert(r.end(), {d[0] / kPixel, d[1] / kPixel});
        const auto i = static_cast<std::size_t>(m.landmark);
        if (seen[i]) {
          if (sights != nullptr) sights->push_back(std::ssize(r));
        } else {  // the first sight and the prior give it its place
          seen[i] = true;
          r.push_back((1.0 / (Point(x, m.landmark) - Camera(x, k)).norm() - kRho) / kRhoSigma);
        }
      }
    }
    return Eigen::Map<VectorXd>(r.data(), std::ssize(r));
  }
  double Cost(const VectorXd& x) const {
    std::vector<Eigen::Index> sights;
    const VectorXd r = Residuals(x, &sights);
    double cost = 0.5 * r.squaredNorm();
    for (const Eigen::Index end : sights) {
      const double d = r.segment<2>(end - 2).norm();
      cost += Rho(loss, d) - 0.5 * d * d;
    }
    return cost;
  }
  /// J' J and J' r by central differences, each sight counted with its weight at x.
  void NormalEquations(const VectorXd& x, MatrixXd& a, VectorXd& b) const {
    std::vector<Eigen::Index> sights;
    const VectorXd r = Residuals(x, &sights);
    MatrixXd j(r.size(), x.size());
    constexpr double kStep = 1e-5;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const VectorXd d = kStep * VectorXd::Unit(x.size(), i);
      j.col(i) = (Residuals(x + d) - Residuals(x - d)) / (2.0 * kStep);
    }
    VectorXd w = VectorXd::Ones(r.size());
    for (const Eigen::Index end : sights) {
      w.segment<2>(end - 2).setConstant(Weight(loss, r.segment<2>(end - 2).norm()));
    }
    a = j.transpose() * w.asDiagonal() * j;
    b = j.transpose() * w.asDiagonal() * r;
  }
  System Filter() const {
    System system = MapSystem(InverseDepthPixels(kPixel), testing::WithPrior(kRho, kRhoSigma));
    system.sensors[0].loss = loss;
    return system;
  }
  VectorXd Solution(const Found& found) const {
    VectorXd x(truth.size());
    for (int k = 1; k < steps; ++k) {
      x.segment<3>(3 * (k - 1)) = found.Camera(static_cast<std::size_t>(k));
    }
    for (int i = 0; i < points; ++i) {
      x.segment<3>(3 * (steps - 1 + i)) = found.Landmark(i).position;
    }
    return x;
  }
  /// At the minimum of the cost written out here, with its covariance.
  void ExpectSolved(const Found& found) const {
    ASSERT_FALSE(found.failed);
    ASSERT_EQ(found.states.size(), frames.size());
    ASSERT_EQ(found.map.size(), static_cast<std::size_t>(points));
    const VectorXd x = Solution(found);
    EXPECT_NEAR(found.Cost(), Cost(x), 1e-7 * Cost(x));  // nine digits are told
    EXPECT_LT(Cost(x), Cost(truth));
    MatrixXd a;
    VectorXd b;
    NormalEquations(x, a, b);
    // What is left to go, in sigma. Third derivatives times 1e-10 leave 1e-8 in J.
    const MatrixXd p = a.inverse();
    EXPECT_LT(std::sqrt(b.dot(p * b)), 1e-5);
    const auto expect_equal = [&](const MatrixXd& its, Eigen::Index at) {
      const MatrixXd expected = p.block<3, 3>(at, at);
      EXPECT_LT((its - expected).norm(), 1e-6 * expected.norm()) << at;
    };
    for (int k = 1; k < steps; ++k) {
      expect_equal(found.states[static_cast<std::size_t>(k)].covariance().Dense(), 3 * (k - 1));
    }
    for (int i = 0; i < points; ++i) {
      expect_equal(found.Landmark(i).covariance, 3 * (steps - 1 + i));
    }
  }
};

TEST(CeresBatchLandmarks, IsAtTheMinimumOfTheCostWrittenOutWithItsCovariance) {
  const Problem problem(25, 12);
  problem.ExpectSolved(Solve(problem.Filter(), problem.frames));
}

TEST(CeresBatchLandmarks, ALossCountsEachSightWithItsWeight) {
  for (const RobustLoss loss : {RobustLoss{LossKind::kHuber, 1.5}, {LossKind::kCauchy, 2.0}}) {
    Problem problem(25, 12, 23);
    problem.loss = loss;
    problem.ExpectSolved(Solve(problem.Filter(), problem.frames, "max_iterations: 500\n"));
  }
}

TEST(CeresBatchLandmarks, AnchorsGiveTheSameAsSixNumbers) {
  const Problem problem(25, 12);
  const Found six = Solve(problem.Filter(), problem.frames);
  const auto expect_equal = [&](const auto& model) {
    const Found found =
        Solve(MapSystem(model, testing::WithPrior(kRho, kRhoSigma)), problem.frames);
    EXPECT_NEAR(found.Cost(), six.Cost(), 1e-7 * six.Cost());
    ASSERT_EQ(found.map.size(), six.map.size());
    for (std::size_t i = 0; i < six.map.size(); ++i) {
      EXPECT_LT((found.map[i].position - six.map[i].position).norm(), 1e-6);
      EXPECT_LT((found.map[i].covariance - six.map[i].covariance).norm(),
                1e-6 * six.map[i].covariance.norm());
    }
    EXPECT_NEAR(found.map[0].inverse_distance, six.map[0].inverse_distance, 1e-6);
    EXPECT_NEAR(found.map[0].sigma, six.map[0].sigma, 1e-6);
  };
  expect_equal(testing::AnchoredPixels<ALIDADE_ROLE_SHARED>(kPixel));
  expect_equal(testing::AnchoredPixels<0>(kPixel));
}

// The solve of all data starts at a filter's estimates, the last of the data so far at the solution
// of the frame before.
TEST(CeresBatchLandmarks, AnotherStartLeadsToTheSameSolution) {
  const Problem problem(12, 8);
  const Found all = Solve(problem.Filter(), problem.frames);
  const auto so_far = testing::MakeBatch(problem.Filter(), "data: so_far\n");
  for (const Frame& frame : problem.frames) so_far->Process(frame);
  ASSERT_FALSE(so_far->failed());
  EXPECT_LT((testing::PositionOf(*so_far) - all.Camera(problem.frames.size() - 1)).norm(), 1e-7);
  const std::vector<LandmarkEstimate> map = so_far->landmarks();
  ASSERT_EQ(map.size(), all.map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    EXPECT_LT((map[i].position - all.map[i].position).norm(), 1e-6);
  }
}

// Points known exactly give the scale; what is seen without noise then gives the truth.
TEST(CeresBatchLandmarks, WhatIsSeenWithoutNoiseGivesTheTruth) {
  constexpr double kSigma = 1e-7;
  Problem problem(12, 12);
  LandmarkOptions options = testing::WithPrior(kRho, kRhoSigma);
  for (int i = 0; i < 3; ++i) {
    const Vector3d p = problem.Point(problem.truth, i);
    options.known.push_back({i, {p[0], p[1], p[2]}, 0.0});
  }
  for (std::size_t k = 0; k < problem.frames.size(); ++k) {
    for (Measurement& m : problem.frames[k].measurements) {
      const Vector2d z = problem.Pixel(problem.truth, static_cast<int>(k), m.landmark);
      m.values = {z[0], z[1]};
    }
  }
  const Found found = Solve(MapSystem(InverseDepthPixels(kSigma), options), problem.frames);
  ASSERT_FALSE(found.failed) << found.events.back().text;
  const VectorXd error = problem.Solution(found) - problem.truth;
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(found.Landmark(0).covariance.norm(), 0.0);
}

TEST(CeresBatchLandmarks, WhatTheFilterForgetsAndMeetsAgainIsAnotherLandmark) {
  const Problem problem(25, 12);
  std::vector<Frame> frames = problem.frames;
  for (std::size_t k = 10; k < 14; ++k) {  // landmark 4 is out of sight
    std::erase_if(frames[k].measurements, [](const Measurement& m) { return m.landmark == 4; });
  }
  System system = problem.Filter();
  system.landmarks->unseen_frames = 3;
  const Found found = Solve(system, frames);
  ASSERT_FALSE(found.failed);
  EXPECT_EQ(found.Landmark(4).generation, 1);
  EXPECT_EQ(found.Landmark(3).generation, 0);
  // The same as if it had come with another id.
  for (std::size_t k = 14; k < frames.size(); ++k) {
    for (Measurement& m : frames[k].measurements) {
      if (m.landmark == 4) m.landmark = 104;
    }
  }
  const Found other = Solve(system, frames);
  EXPECT_EQ(other.Cost(), found.Cost());
  EXPECT_LT((other.Landmark(104).position - found.Landmark(4).position).norm(), 1e-9);
}

// What waits in the filter that lends its measurements is not lent: it would wait twice.
TEST(CeresBatchLandmarks, WhatAFilterAcceptedEntersAtOnce) {
  const Problem problem(12, 8);
  System system = problem.Filter();
  system.landmarks->enter_after = 3;
  const auto initialised = [&](const std::string& options) {
    const auto batch = testing::MakeBatch(system, options + "data: so_far\n");
    return batch->Process(problem.frames[0]).landmarks.initialised;
  };
  EXPECT_EQ(initialised(""), 0);
  EXPECT_EQ(initialised("use: {accepted_by: ekf}\n"),
            static_cast<int>(problem.frames[0].measurements.size()));
}

TEST(CeresBatchLandmarks, GivesTheSameBytesTwice) {
  const Problem problem(15, 8);
  const Found one = Solve(problem.Filter(), problem.frames);
  const Found two = Solve(problem.Filter(), problem.frames);
  EXPECT_EQ(problem.Solution(one), problem.Solution(two));
  EXPECT_EQ(one.events.back().text, two.events.back().text);
}

// ---- a camera that turns ------------------------------------------------------------------------

const std::string kMotion =
    "state: {cam: {model: quaternion_pose, noise: {linear_acceleration: 0.3, "
    "angular_acceleration: 0.05}, initial: {position: {mean: [0, 0, 0], sigma: 0}, orientation: "
    "{mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}, velocity: {mean: [0.2, 0, 0], sigma: 0.1}, "
    "angular_velocity: {mean: [0, 0, 0], sigma: 0.05}}}}\n";
const std::string kSensors =
    "landmarks: {form: inverse_depth, prior: {inverse_distance: 0.39, sigma: 0.09}}\n"
    "sensors:\n"
    "  pixels: {model: inverse_depth_feature, stream: tracks, sigma_px: 1, roles: {position: "
    "cam.position, orientation: cam.orientation, landmark: landmarks}}\n"
    "  known: {model: depth_feature, stream: known, sigma_px: 1, sigma_depth_m: 0.02, roles: "
    "{position: cam.position, orientation: cam.orientation, landmark: landmarks}}\n";
const std::string kDrawn =
    "frames: 40, rate_hz: 30, noise_px: 1, known: {count: 4, relative_sigma: 0.005}, "
    "points: {box: {min: [-0.8, -0.7, 1.6], max: [1.2, 0.7, 3.6]}, count: 40}, trajectory: "
    "{model: {linear_acceleration: 0.3, angular_acceleration: 0.05, velocity: [0.2, 0, 0]}}";

// Its noise is of rank 6 in 12: v' and omega' are what moves r and q.
TEST(CeresBatchLandmarks, NoiseOfLowRankMovesTheCameraExactlyAsItsModelSays) {
  const testing::MadeScene made = testing::MakeScene(kDrawn);
  const Config config = Config::FromText(testing::kCamera + kMotion + kSensors, "system.yaml");
  const System system = BuildSystem(config.root(), testing::Shipped(), {});
  const Config entry = Config::FromText("type: ceres_batch", "batch.yaml");
  const auto batch = testing::Shipped().CreateEstimator("ceres_batch", entry.root())(
      system, made.scene->streams());
  std::vector<Frame> frames;
  for (Frame frame; made.scene->Next(frame);) frames.push_back(frame);
  const Found found = Solve(*batch, frames);
  ASSERT_FALSE(found.failed) << found.events.back().text;
  ASSERT_EQ(found.states.size(), 40u);
  const StateLayout& layout = system.layout;
  const auto value = [&](std::size_t k, const char* block) {
    return found.states[k].value(layout.Find(block));
  };
  double moved = 0.0;
  for (std::size_t k = 1; k < found.states.size(); ++k) {
    const double dt_s = Seconds(frames[k].stamp - frames[k - 1].stamp);
    double turn[3], expected[4], defect[3];
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(value(k, "cam.position")[i],
                  value(k - 1, "cam.position")[i] + dt_s * value(k, "cam.velocity")[i], 1e-12);
      turn[i] = dt_s * value(k, "cam.angular_velocity")[i];
      moved =
          std::max(moved, std::abs(value(k, "cam.velocity")[i] - value(k - 1, "cam.velocity")[i]));
    }
    UnitQuaternion::Plus(value(k - 1, "cam.orientation"), turn, expected);
    UnitQuaternion::Minus(value(k, "cam.orientation"), expected, defect);
    for (const double d : defect) EXPECT_NEAR(d, 0.0, 1e-12);
  }
  EXPECT_GT(moved, 1e-3);  // there was something to hold
  EXPECT_EQ(found.map.size(), 40u);
}

}  // namespace
}  // namespace alidade
