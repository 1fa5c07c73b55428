// SPDX-License-Identifier: Apache-2.0
//
// Tests the fixed-lag smoother with landmarks. Compares it with the Kalman filter on a linear map,
// and with the batch. The smoother differs from the batch by the linearisation of data that have
// left the window.
#include "batch_landmarks_fixture.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using testing::Found;
using testing::FrameOf;
using testing::kPixel;
using testing::kRho;
using testing::kRhoSigma;
using testing::MakeBatch;
using testing::MakeFixedLag;
using testing::MapProblem;
using testing::MapSystem;
using testing::Observation;
using testing::Solve;

/// Expects that two estimates and their covariances agree to within `sigmas`.
void ExpectNear(const Vector3d& found, const MatrixXd& found_p, const Vector3d& expected,
                const MatrixXd& p, double sigmas, const std::string& what) {
  const Eigen::VectorXd sigma = p.diagonal().cwiseSqrt();
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(found[i], expected[i], sigmas * sigma[i]) << what;
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(found_p(i, j), p(i, j), 100.0 * sigmas * sigma[i] * sigma[j]) << what;
    }
  }
}

void ExpectNear(const Estimator& found, const Estimator& expected, double sigmas,
                const std::string& what) {
  ExpectNear(testing::PositionOf(found), found.state().covariance().Dense().topLeftCorner(3, 3),
             testing::PositionOf(expected),
             expected.state().covariance().Dense().topLeftCorner(3, 3), sigmas, what);
  const std::vector<LandmarkEstimate> map = found.landmarks(), expected_map = expected.landmarks();
  ASSERT_EQ(map.size(), expected_map.size()) << what;
  for (const LandmarkEstimate& landmark : expected_map) {
    const LandmarkEstimate* const other = testing::Find(map, landmark.id);
    ASSERT_NE(other, nullptr) << what << ' ' << landmark.id;
    EXPECT_EQ(other->generation, landmark.generation);
    ExpectNear(other->position, other->covariance, landmark.position, landmark.covariance, sigmas,
               what + " landmark " + std::to_string(landmark.id));
  }
}

TEST(FixedLagLandmarks, OverAllFramesIsTheBatchOfTheDataSoFar) {
  const MapProblem map(20, 12);
  const auto lag = MakeFixedLag(map.Filter(), "lag_s: 1e12\n");
  const auto batch = MakeBatch(map.Filter(), "mode: filtering\nsolver: sparse\n");
  for (const Frame& frame : map.frames) {
    lag->Process(frame);
    batch->Process(frame);
    ExpectNear(*lag, *batch, 1e-8, std::to_string(frame.timestamp));
  }
  EXPECT_FALSE(lag->failed());
}

/// Problem and data of measured offsets to points that leave the view and return. The prior sigma
/// of two points is 0.2 m, and one point is known exactly.
struct LinearMap {
  Problem problem;
  std::vector<Frame> frames;

  explicit LinearMap(int steps) {
    constexpr double kNoise = 0.05, kStart = 0.3, kKnown = 0.2;
    constexpr int kPoints = 14;
    Random random(7);
    const auto vector = [&](double sigma) {
      return Vector3d(sigma * random.Normal(), sigma * random.Normal(), sigma * random.Normal());
    };
    LandmarkOptions options;
    options.max_missed_frames = 3;
    std::vector<Vector3d> points;
    for (int i = 0; i < kPoints; ++i) points.push_back(vector(1.0));
    for (int i = 0; i < 3; ++i) {
      const double sigma = i < 2 ? kKnown : 0.0;
      const Vector3d told = points[static_cast<std::size_t>(i)] + vector(sigma);
      options.known.push_back({i, {told[0], told[1], told[2]}, sigma});
    }
    Vector3d r = vector(kStart);
    for (int k = 0; k < steps; ++k, r += vector(0.1 * std::sqrt(0.1))) {
      std::vector<Observation> observations;
      for (int i = 0; i < kPoints; ++i) {
        const int phase = (k + 5 * i) % 17;  // the point is absent for 10 frames
        if (phase >= 7 || (phase == 2 && i % 3 == 0) || k % 9 == 4) continue;
        const Vector3d z = points[static_cast<std::size_t>(i)] - r + vector(kNoise);
        observations.push_back({i, {z[0], z[1], z[2]}});
      }
      frames.push_back(FrameOf(0.1 * k, observations));
    }
    problem = MapSystem(testing::Offset(kNoise), options, kStart);
  }
};

TEST(FixedLagLandmarks, OfALinearMapIsTheKalmanFilterWhateverTheWindow) {
  const LinearMap map(60);
  for (const char* const options : {"lag_s: 0.25\n", "lag_s: 0.04\n", "lag_s: 1.3\n"}) {
    const auto lag = MakeFixedLag(map.problem, options);
    Ekf ekf = testing::EkfOf(map.problem);
    int generations = 0;
    for (const Frame& frame : map.frames) {
      lag->Process(frame);
      ekf.Process(frame);
      ExpectNear(*lag, ekf, 1e-9, options + std::to_string(frame.timestamp));
      for (const LandmarkEstimate& landmark : ekf.landmarks()) {
        generations = std::max(generations, landmark.generation);
      }
    }
    EXPECT_FALSE(lag->failed());
    EXPECT_GE(generations, 2);
  }
}

/// Appends a late frame without measurements. All earlier frames leave the window before the late
/// frame is processed.
std::vector<Frame> WithLateFrame(std::vector<Frame> frames) {
  frames.push_back(FrameOf(100.0, {}));
  return frames;
}

/// Expects that the smoother equals the batch. All data are linearised at the solution of all data
/// before they leave the window, so no information is lost.
void ExpectNothingIsLost(const Problem& problem, const std::vector<Frame>& frames) {
  const std::vector<Frame> all = WithLateFrame(frames);
  const auto batch = MakeBatch(problem, "solver: sparse\n");
  const Found smoothed = Solve(*batch, all);
  ASSERT_FALSE(smoothed.failed);
  const auto lag = MakeFixedLag(problem, "lag_s: 50\n");
  for (const Frame& frame : all) lag->Process(frame);
  ASSERT_FALSE(lag->failed());
  ExpectNear(*lag, *batch, 1e-7, "current");

  const auto lagged = MakeFixedLag(problem, "lag_s: 50\noutput: lagged\n");
  const Found later = Solve(*lagged, all);
  ASSERT_FALSE(later.failed);
  ASSERT_EQ(later.states.size(), all.size());
  for (std::size_t k = 0; k < all.size(); ++k) {
    ExpectNear(later.Camera(k), later.states[k].covariance().Dense(), smoothed.Camera(k),
               smoothed.states[k].covariance().Dense(), 1e-7, "lagged " + std::to_string(k));
  }
  ExpectNear(*lagged, *batch, 1e-7, "lagged");
}

TEST(FixedLagLandmarks, WhatLeavesAtTheSolutionOfAllDataLosesNothing) {
  const MapProblem map(25, 12);
  ExpectNothingIsLost(map.Filter(), map.frames);
  LandmarkOptions options = testing::WithPrior(kRho, kRhoSigma);
  ExpectNothingIsLost(MapSystem(testing::AnchoredPixels<ALIDADE_ROLE_SHARED>(kPixel), options, 0.1),
                      map.frames);
  ExpectNothingIsLost(MapSystem(testing::AnchoredPixels<0>(kPixel), options), map.frames);
  for (int i = 0; i < 4; ++i) {
    const Vector3d p = map.Point(map.truth, i);
    options.known.push_back({i, {p[0], p[1], p[2]}, i < 2 ? 0.0 : 0.05});
  }
  ExpectNothingIsLost(MapSystem(testing::InverseDepthPixels(kPixel), options), map.frames);
}

TEST(FixedLagLandmarks, WhatLeavesHasTheWeightOfTheSolution) {
  MapProblem map(25, 12, 23);
  map.loss = {LossKind::kHuber, 1.5};
  ExpectNothingIsLost(map.Filter(), map.frames);
}

/// Returns the mean distance, over all frames, between the newest estimate of `filter` and that of
/// the filtering batch. The distance is in sigmas of the batch.
double MeanDistance(Estimator& filter, const MapProblem& map, const std::vector<State>& batch) {
  double sum = 0.0;
  for (std::size_t k = 0; k < map.frames.size(); ++k) {
    filter.Process(map.frames[k]);
    if (k == 0) continue;  // the state of the first frame is known exactly
    const Eigen::Map<const Vector3d> expected(batch[k].values().data());
    const Vector3d apart = testing::PositionOf(filter) - expected;
    sum += std::sqrt(apart.dot(batch[k].covariance().Dense().ldlt().solve(apart)));
  }
  EXPECT_FALSE(filter.failed());
  return sum / static_cast<double>(map.frames.size() - 1);
}

// Data that leave a longer window are linearised at a more accurate estimate.
TEST(FixedLagLandmarks, ALongerWindowIsNearerTheBatchThanAFilter) {
  const MapProblem map(40, 20);
  std::vector<State> states;
  const auto batch = MakeBatch(map.Filter(), "mode: filtering\nsolver: sparse\n");
  for (const Frame& frame : map.frames) {
    batch->Process(frame);
    states.push_back(batch->state());
  }
  Ekf ekf = testing::EkfOf(map.Filter());
  const auto of_window = [&](const std::string& lag_s) {
    return MeanDistance(*MakeFixedLag(map.Filter(), "lag_s: " + lag_s + "\n"), map, states);
  };
  const double filter = MeanDistance(ekf, map, states);
  const double middle = of_window("0.75"), longest = of_window("2.05");
  EXPECT_LT(middle, 0.2 * filter);
  EXPECT_LT(longest, 0.05 * filter);
  RecordProperty("sigmas", std::to_string(filter) + ' ' + std::to_string(middle) + ' ' +
                               std::to_string(longest));
}

// A camera passes points that enter and leave its view. The uncertainty of its position therefore
// grows. A prior with old linearisation points, such as fixed anchors, would wrongly reduce this
// uncertainty.
TEST(FixedLagLandmarks, OnAWayAlongPointsItKnowsNoMoreThanTheFilter) {
  constexpr int kSteps = 120, kPoints = 240;
  LandmarkOptions options = testing::WithPrior(kRho, kRhoSigma);
  options.max_missed_frames = 1;
  const Problem problem = MapSystem(testing::InverseDepthPixels(kPixel), options);
  Random random(3);
  std::vector<Vector3d> points;
  for (int i = 0; i < kPoints; ++i) {
    points.emplace_back(-1.0 + 0.06 * i, 0.5 * random.Normal(), 1.6 + 0.1 * (i % 9));
  }
  const auto window = testing::MakeFixedLag(problem, "lag_s: 0.45\n");
  Ekf ekf = testing::EkfOf(problem);
  Vector3d r = Vector3d::Zero();
  for (int k = 0; k < kSteps; ++k) {
    std::vector<Observation> observations;
    for (int i = 0; i < kPoints; ++i) {
      const Vector3d h = points[static_cast<std::size_t>(i)] - r;
      if (std::abs(h[0] / h[2]) > 0.4) continue;
      observations.push_back(
          {i, {h[0] / h[2] + kPixel * random.Normal(), h[1] / h[2] + kPixel * random.Normal()}});
    }
    const Frame frame = FrameOf(0.1 * k, observations);
    window->Process(frame);
    ekf.Process(frame);
    r += Vector3d(0.08, 0.03 * random.Normal(), 0.03 * random.Normal());
  }
  ASSERT_FALSE(window->failed());
  const auto sigma = [](const Estimator& filter, int axis) {
    return std::sqrt(filter.state().covariance().Variance(axis));
  };
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(sigma(*window, axis), 0.8 * sigma(ekf, axis)) << axis;
  }
}

}  // namespace
}  // namespace alidade
