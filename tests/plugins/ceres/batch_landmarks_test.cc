// SPDX-License-Identifier: Apache-2.0
//
// Tests the batch with landmarks. Compares it with the least-squares solution for the states,
// computed here.
#include "batch_landmarks_fixture.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Found;
using testing::FrameOf;
using testing::InverseDepthPixels;
using testing::kPixel;
using testing::kRho;
using testing::kRhoSigma;
using testing::MapProblem;
using testing::MapSystem;
using testing::Observation;
using testing::Offset;
using testing::Solve;

/// Normal equations of the positions x_0, x_1, .., with 3 numbers each. Measured differences
/// determine the positions.
struct Differences {
  MatrixXd information;
  VectorXd right;

  explicit Differences(int count)
      : information(MatrixXd::Zero(3 * count, 3 * count)), right(VectorXd::Zero(3 * count)) {}
  /// Adds a measurement of x_b - x_a. If a < 0, it is a measurement of x_b.
  void Add(int a, int b, const Vector3d& difference, double sigma) {
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
  }
};

/// The map consists of measured offsets to points. The prior sigma is 0.2 m for some points, and
/// 0.3 m for the first position.
TEST(CeresBatchLandmarks, ALinearMapIsThatOfLeastSquaresOverAllSteps) {
  constexpr int kSteps = 12, kPoints = 6;
  constexpr double kNoise = 0.05, kStart = 0.3, kKnown = 0.2;
  const double step = 0.1 * std::sqrt(0.1);
  Random random(7);
  const auto vector = [&](double sigma) {
    return Vector3d(sigma * random.Normal(), sigma * random.Normal(), sigma * random.Normal());
  };
  Differences differences(kSteps + kPoints);
  LandmarkOptions options;
  std::vector<Vector3d> points;
  for (int i = 0; i < kPoints; ++i) points.push_back(vector(1.0));
  for (int i = 0; i < 2; ++i) {
    const Vector3d told = points[static_cast<std::size_t>(i)] + vector(kKnown);
    options.known.push_back({i, {told[0], told[1], told[2]}, kKnown});
    differences.Add(-1, kSteps + i, told, kKnown);
  }
  differences.Add(-1, 0, Vector3d::Zero(), kStart);
  std::vector<Frame> frames;
  Vector3d r = vector(kStart);
  for (int k = 0; k < kSteps; ++k, r += vector(step)) {
    if (k > 0) differences.Add(k - 1, k, Vector3d::Zero(), step);
    std::vector<Observation> observations;
    for (int i = 0; i < kPoints; ++i) {
      if ((k + 2 * i) % 5 >= 3 || k < i / 2) continue;
      const Vector3d z = points[static_cast<std::size_t>(i)] - r + vector(kNoise);
      observations.push_back({i, {z[0], z[1], z[2]}});
      differences.Add(k, kSteps + i, z, kNoise);
    }
    frames.push_back(FrameOf(0.1 * k, observations));
  }
  const Found found = Solve(MapSystem(Offset(kNoise), options, kStart), frames);
  const MatrixXd covariance = differences.information.inverse();
  const VectorXd solution = covariance * differences.right;
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

// For data without landmarks, a problem that may have landmarks has the same solution as a problem
// that cannot have landmarks.
TEST(CeresBatchLandmarks, WithoutAnyTheSolutionIsThatOfTheProblemWithoutThem) {
  const auto expect_equal = [](const Problem& problem, const std::vector<Frame>& frames,
                               double tolerance) {
    Problem with = problem;
    with.landmarks = LandmarkOptions{};
    const Found found = Solve(with, frames), expected = Solve(problem, frames);
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
  Problem robust = testing::DepthFilter();
  expect_equal(robust, depth, 1e-6);  // the noise, which depends on the state, settles to 1e-9
  robust.sensors[0].loss = {LossKind::kHuber, 1.0};
  expect_equal(robust, depth, 1e-5);  // steps end below 1e-6 sigma
}

// ---- inverse depth ------------------------------------------------------------------------------

TEST(CeresBatchLandmarks, IsAtTheMinimumOfTheCostWrittenOutWithItsCovariance) {
  const MapProblem map(25, 12);
  map.ExpectSolved(Solve(map.Filter(), map.frames));
}

TEST(CeresBatchLandmarks, ALossCountsEachObservationWithItsWeight) {
  for (const RobustLoss loss : {RobustLoss{LossKind::kHuber, 1.5}, {LossKind::kCauchy, 2.0}}) {
    MapProblem map(25, 12, 23);
    map.loss = loss;
    map.ExpectSolved(Solve(map.Filter(), map.frames, "max_iterations: 500\n"));
  }
}

TEST(CeresBatchLandmarks, AnchorsGiveTheSameAsSixNumbers) {
  const MapProblem map(25, 12);
  const Found six = Solve(map.Filter(), map.frames);
  const auto expect_equal = [&](const auto& model) {
    const Found found = Solve(MapSystem(model, testing::WithPrior(kRho, kRhoSigma)), map.frames);
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

// The smoothing mode starts from the estimates of a filter. The last solve of the filtering mode
// starts from the solution of the previous frame.
TEST(CeresBatchLandmarks, AnotherStartLeadsToTheSameSolution) {
  const MapProblem map(12, 8);
  const Found all = Solve(map.Filter(), map.frames);
  const auto so_far = testing::MakeBatch(map.Filter(), "mode: filtering\n");
  for (const Frame& frame : map.frames) so_far->Process(frame);
  ASSERT_FALSE(so_far->failed());
  EXPECT_LT((testing::PositionOf(*so_far) - all.Camera(map.frames.size() - 1)).norm(), 1e-7);
  const std::vector<LandmarkEstimate> estimates = so_far->landmarks();
  ASSERT_EQ(estimates.size(), all.map.size());
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    EXPECT_LT((estimates[i].position - all.map[i].position).norm(), 1e-6);
  }
}

// Exactly known points determine the scale. Measurements without noise then determine the true
// values.
TEST(CeresBatchLandmarks, WhatIsSeenWithoutNoiseGivesTheTruth) {
  constexpr double kPixelSigma = 1e-7;
  MapProblem map(12, 12);
  LandmarkOptions options = testing::WithPrior(kRho, kRhoSigma);
  for (int i = 0; i < 3; ++i) {
    const Vector3d p = map.Point(map.truth, i);
    options.known.push_back({i, {p[0], p[1], p[2]}, 0.0});
  }
  for (std::size_t k = 0; k < map.frames.size(); ++k) {
    for (Measurement& m : map.frames[k].measurements) {
      const Vector2d z = map.Pixel(map.truth, static_cast<int>(k), m.landmark);
      m.values = {z[0], z[1]};
    }
  }
  const Found found = Solve(MapSystem(InverseDepthPixels(kPixelSigma), options), map.frames);
  ASSERT_FALSE(found.failed) << found.events.back().text;
  const VectorXd error = map.Solution(found) - map.truth;
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(found.Landmark(0).covariance.norm(), 0.0);
}

}  // namespace
}  // namespace alidade
