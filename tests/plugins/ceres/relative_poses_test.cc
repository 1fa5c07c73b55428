// SPDX-License-Identifier: Apache-2.0
//
// Tests keyframes. A keyframe is a landmark at an earlier position of the body. Later measurements
// are relative to the keyframe.
#include "batch_landmarks_fixture.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Found;
using testing::FrameOf;
using testing::MapSystem;
using testing::Observation;
using testing::Solve;

constexpr double kStart = 0.3, kNoise = 0.05;

/// A walk in which every frame k is a keyframe. Offsets z = r_j - r_k + n are measured from some
/// frames to earlier keyframes. The solution is computed here, by least squares in the positions
/// only.
struct Walked {
  std::vector<Frame> frames;
  MatrixXd covariance;
  VectorXd solution;

  explicit Walked(int steps, int loop) {
    Random random(5);
    const auto vector = [&](double sigma) {
      return Vector3d(sigma * random.Normal(), sigma * random.Normal(), sigma * random.Normal());
    };
    const double step = 0.1 * std::sqrt(0.1);
    MatrixXd information = MatrixXd::Zero(3 * steps, 3 * steps);
    VectorXd right = VectorXd::Zero(3 * steps);
    const auto add = [&](int from, int to, const Vector3d& difference, double sigma) {
      for (int e = 0; e < 3; ++e) {
        VectorXd a = VectorXd::Zero(3 * steps);
        a[3 * to + e] += 1.0;
        if (from >= 0) a[3 * from + e] -= 1.0;
        information += a * a.transpose() / (sigma * sigma);
        right += a * difference[e] / (sigma * sigma);
      }
    };
    std::vector<Vector3d> path;
    for (int k = 0; k < steps; ++k) {
      path.push_back(k == 0 ? vector(kStart) : Vector3d(path.back() + vector(step)));
      add(k - 1, k, Vector3d::Zero(), k == 0 ? kStart : step);
      Frame frame = FrameOf(0.1 * k, {});
      const auto see = [&](int j) {
        const Vector3d z = path[static_cast<std::size_t>(j)] - path.back() + vector(kNoise);
        frame.measurements.push_back({frame.timestamp, 0, j, {z[0], z[1], z[2]}, {}});
        add(k, j, z, kNoise);
      };
      if (k > 0) see(k - 1);
      if (k >= loop && k % 4 == 0) see(k - loop);
      frame.measurements.push_back(
          {frame.timestamp, 0, k, {0, 0, 0}, std::vector<double>(9, 0.0)});  // defines keyframe k
      frames.push_back(std::move(frame));
    }
    covariance = information.inverse();
    solution = covariance * right;
  }
  void ExpectPosition(const Vector3d& found, const MatrixXd& p, int k) const {
    EXPECT_LT((found - solution.segment<3>(3 * k)).norm(), 1e-9) << k;
    EXPECT_LT((p - covariance.block<3, 3>(3 * k, 3 * k)).norm(), 1e-9) << k;
  }
};

Problem KeyframeSystem() { return MapSystem(testing::Offset(kNoise), LandmarkOptions{}, kStart); }

TEST(RelativePoses, TheBatchIsLeastSquaresOfThePositionsAlone) {
  const int steps = 30;
  const Walked walked(steps, 15);
  for (const char* const solver : {"solver: sparse\n", "solver: dense\n"}) {
    const Found found = Solve(KeyframeSystem(), walked.frames, solver);
    ASSERT_FALSE(found.failed) << solver;
    for (int k = 0; k < steps; ++k) {
      const auto at = static_cast<std::size_t>(k);
      walked.ExpectPosition(found.Camera(at), found.states[at].covariance().Dense(), k);
      walked.ExpectPosition(found.Landmark(k).position, found.Landmark(k).covariance, k);
    }
  }
}

// The state of an EKF contains the clones. At the end, the EKF's estimates of all clones equal
// those of the batch.
TEST(RelativePoses, TheFilterWithClonesKnowsTheSameAtTheEnd) {
  const int steps = 30;
  const Walked walked(steps, 15);
  const Problem problem = KeyframeSystem();
  Ekf ekf = testing::EkfOf(problem);
  const auto window = testing::MakeFixedLag(problem, "lag_s: 0.35\n");
  for (const Frame& frame : walked.frames) {
    ekf.Process(frame);
    window->Process(frame);
  }
  const auto expect = [&](const Estimator& filter) {
    ASSERT_FALSE(filter.failed());
    walked.ExpectPosition(testing::PositionOf(filter),
                          filter.state().covariance().Dense().topLeftCorner(3, 3), steps - 1);
    const std::vector<LandmarkEstimate> map = filter.landmarks();
    ASSERT_EQ(map.size(), std::size_t{steps});
    for (int k = 0; k < steps; ++k) {
      const LandmarkEstimate& clone = *testing::Find(map, k);
      walked.ExpectPosition(clone.position, clone.covariance, k);
    }
  };
  expect(ekf);
  expect(*window);
}

/// Returns the number of flops of an iteration, read from the event `solution`.
double FlopsOf(const Found& found) {
  const std::string& text = found.events.back().text;
  const std::size_t end = text.rfind(" flops"), begin = text.rfind(' ', end - 1);
  return std::stod(text.substr(begin, end - begin));
}

// A single loop closure connects the last of 2000 frames with the first. Each front in between
// contains only the additional rows of this closure.
TEST(RelativePoses, ALoopOverTwoThousandFramesStaysSparse) {
  constexpr int kFrames = 2000;
  const auto frames = [&](bool closed) {
    std::vector<Frame> all;
    for (int k = 0; k < kFrames; ++k) {
      Frame frame = FrameOf(0.1 * k, {});
      const double z = 0.01 * std::sin(0.3 * k);
      const auto see = [&](int j) {
        frame.measurements.push_back({frame.timestamp, 0, j, {z, 0.0, -z}, {}});
      };
      if (k > 0) see(k - 1);
      if (closed && k + 1 == kFrames) see(0);
      const Measurement self{frame.timestamp, 0, k, {0, 0, 0}, std::vector<double>(9, 0.0)};
      if (k > 0) frame.measurements.push_back(self);
      all.push_back(std::move(frame));
    }
    return all;
  };
  LandmarkOptions forgetful;
  forgetful.max_missed_frames = 3;
  forgetful.known.push_back({0, {0.0, 0.0, 0.0}, 0.1});  // the filter never removes this landmark
  const Problem problem = MapSystem(testing::Offset(kNoise), forgetful, kStart);
  const Found open = Solve(problem, frames(false), "solver: sparse\n");
  const Found closed = Solve(problem, frames(true), "solver: sparse\n");
  ASSERT_FALSE(open.failed || closed.failed);
  RecordProperty("flops", std::to_string(FlopsOf(open)) + ' ' + std::to_string(FlopsOf(closed)));
  EXPECT_LT(FlopsOf(closed), 2.0 * FlopsOf(open));
  EXPECT_LT(FlopsOf(closed), 2e3 * kFrames);
  // The loop closure improves the last position. Without the closure, this position is the sum of
  // 2000 steps of 0.1 m/sqrt(s). With the closure, an offset with a noise of 0.05 m determines it.
  const auto sigma = [](const Found& found) {
    return std::sqrt(found.states.back().covariance().Variance(0));
  };
  EXPECT_LT(sigma(closed), 0.5 * sigma(open));
}

}  // namespace
}  // namespace alidade
