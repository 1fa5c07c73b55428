// SPDX-License-Identifier: Apache-2.0
//
// Tests how landmarks are initialised, converted and removed.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "support/landmark_models.h"

namespace alidade::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

bool IsPoint(const LandmarkEstimate& landmark) {
  return landmark.representation && IsXyz(*landmark.representation);
}

std::vector<double> Vector(const Vector3d& v) { return {v[0], v[1], v[2]}; }

/// A camera performs a random walk. Points are in front of the camera, and all of them can be
/// measured at each step.
struct Scene {
  std::vector<Vector3d> camera, points;
  Random random{7};

  explicit Scene(int steps, int count) {
    Vector3d r = Vector3d::Zero();
    for (int k = 0; k < steps; ++k) {
      camera.push_back(r);
      for (int i = 0; i < 3; ++i) r[i] += 0.1 * std::sqrt(0.1) * random.Normal();
      r[0] += 0.03;
    }
    for (int i = 0; i < count; ++i) {
      points.emplace_back(0.5 * random.Normal(), 0.5 * random.Normal(), 2.0 + 0.3 * (i % 5));
    }
  }
  std::vector<double> OffsetAt(int step, int i, double sigma) {
    Vector3d z = points[static_cast<std::size_t>(i)] - camera[static_cast<std::size_t>(step)];
    for (int e = 0; e < 3; ++e) z[e] += sigma * random.Normal();
    return Vector(z);
  }
  std::vector<double> PixelAt(int step, int i, double sigma) {
    const Vector3d h = points[static_cast<std::size_t>(i)] - camera[static_cast<std::size_t>(step)];
    return {h[0] / h[2] + sigma * random.Normal(), h[1] / h[2] + sigma * random.Normal()};
  }
};

/// Returns true if point i is seen at `step`. The pattern differs from point to point.
bool Seen(int step, int i) { return (step + 2 * i) % 5 < 3 && step >= i / 2; }

TEST(Landmarks, ALinearMapIsThatOfLeastSquaresOverAllSteps) {
  constexpr int kSteps = 12, kPoints = 6, kSize = 3 * (kSteps + kPoints);
  constexpr double kNoise = 0.05, kStart = 0.3;
  Scene scene(kSteps, kPoints);
  Ekf ekf = EkfOf(MapSystem(Offset(kNoise), {}, kStart));
  MatrixXd information = MatrixXd::Zero(kSize, kSize);
  VectorXd right = VectorXd::Zero(kSize);
  // The measured difference is x_b - x_a.
  const auto add = [&](int a, int b, const Vector3d& difference, double sigma) {
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
  add(-1, 0, Vector3d::Zero(), kStart);
  for (int k = 0; k < kSteps; ++k) {
    if (k > 0) add(k - 1, k, Vector3d::Zero(), 0.1 * std::sqrt(0.1));
    std::vector<Observation> observations;
    for (int i = 0; i < kPoints; ++i) {
      if (!Seen(k, i)) continue;
      observations.push_back({i, scene.OffsetAt(k, i, kNoise)});
      add(k, kSteps + i, Eigen::Map<const Vector3d>(observations.back().z.data()), kNoise);
    }
    ekf.Process(FrameOf(0.1 * k, observations));
  }
  const MatrixXd covariance = information.inverse();
  const VectorXd solution = covariance * right;
  EXPECT_LT((PositionOf(ekf) - solution.segment<3>(3 * (kSteps - 1))).norm(), 1e-9);
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ASSERT_EQ(landmarks.size(), std::size_t{kPoints});
  for (int i = 0; i < kPoints; ++i) {
    const int at = 3 * (kSteps + i);
    EXPECT_LT((Find(landmarks, i)->position - solution.segment<3>(at)).norm(), 1e-9);
    EXPECT_LT((Find(landmarks, i)->covariance - covariance.block<3, 3>(at, at)).norm(), 1e-9);
  }
}

/// Computes y = g(r, z, rho) of InverseDepthPixels with independent code.
VectorXd InverseObservation(const VectorXd& x) {
  const double u = x[3], v = x[4];
  VectorXd y(6);
  y << x.head<3>(), std::atan(u), -std::atan(v / std::hypot(u, 1.0)), x[5];
  return y;
}

TEST(Landmarks, EnterWithTheCorrelationsOfTheirInverseObservation) {
  constexpr double kNoise = 0.02, kStart = 0.2;
  Ekf ekf = EkfOf(MapSystem(InverseDepthPixels(kNoise), WithPrior(0.4, 0.3), kStart));
  const std::vector<double> z1 = {0.3, -0.2}, z2 = {-0.4, 0.5};
  const UpdateReport& report = ekf.Process(FrameOf(0.0, {{4, z1}, {9, z2}}));
  EXPECT_EQ(OutcomeFor(report, 4), Outcome::kInitialised);
  EXPECT_EQ(report.landmarks.initialised, 2);
  // Differentiates x = (r, z1, rho1, z2, rho2) -> (r, y1, y2) by central differences.
  VectorXd x(9), sigma(9);
  x << 0, 0, 0, z1[0], z1[1], 0.4, z2[0], z2[1], 0.4;
  sigma << kStart, kStart, kStart, kNoise, kNoise, 0.3, kNoise, kNoise, 0.3;
  const auto g = [](const VectorXd& all) {
    VectorXd first(6), second(6), y(15);
    first << all.head<3>(), all.segment<3>(3);
    second << all.head<3>(), all.segment<3>(6);
    y << all.head<3>(), InverseObservation(first), InverseObservation(second);
    return y;
  };
  MatrixXd j(15, 9);
  for (int i = 0; i < 9; ++i) {
    const VectorXd step = 1e-5 * VectorXd::Unit(9, i);
    j.col(i) = (g(x + step) - g(x - step)) / 2e-5;
  }
  const MatrixXd expected = j * sigma.cwiseAbs2().asDiagonal() * j.transpose();
  EXPECT_LT((ekf.state().covariance().Dense() - expected).cwiseAbs().maxCoeff(), 1e-9);
  const VectorXd y = g(x);
  for (int i = 0; i < 15; ++i)
    EXPECT_NEAR(ekf.state().values()[static_cast<std::size_t>(i)], y[i], 1e-12);
}

TEST(Landmarks, ASharedAnchorGivesWhatAnchorsOfTheirOwnGive) {
  constexpr int kSteps = 40, kPoints = 8;
  Scene scene(kSteps, kPoints);
  Ekf shared = EkfOf(MapSystem(AnchoredPixels<ALIDADE_ROLE_SHARED>(0.005), WithPrior()));
  Ekf alone = EkfOf(MapSystem(AnchoredPixels<0>(0.005), WithPrior()));
  for (int k = 0; k < kSteps; ++k) {
    std::vector<Observation> observations;
    for (int i = 0; i < kPoints; ++i) {
      if (k >= 5 * (i / 4)) observations.push_back({i, scene.PixelAt(k, i, 0.005)});
    }
    const Frame frame = FrameOf(0.1 * k, observations);
    shared.Process(frame);
    alone.Process(frame);
  }
  // The camera, each landmark and each anchor have 3 rows. Two frames have new anchors.
  EXPECT_EQ(shared.state().covariance().size(), 3 + 3 * kPoints + 3 * 2);
  EXPECT_EQ(alone.state().covariance().size(), 3 + 6 * kPoints);
  EXPECT_LT((PositionOf(shared) - PositionOf(alone)).norm(), 1e-9);
  const std::vector<LandmarkEstimate> a = shared.landmarks(), b = alone.landmarks();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LT((a[i].position - b[i].position).norm(), 1e-9);
    EXPECT_LT((a[i].covariance - b[i].covariance).norm(), 1e-9);
  }
}

TEST(Landmarks, ASharedAnchorGoesWithItsLastLandmark) {
  LandmarkOptions options = WithPrior();
  options.max_missed_frames = 2;
  Ekf ekf = EkfOf(MapSystem(AnchoredPixels<ALIDADE_ROLE_SHARED>(0.01), options));
  ekf.Process(FrameOf(0.0, {{1, {0.1, 0.0}}, {2, {0.0, 0.1}}}));
  EXPECT_EQ(ekf.state().covariance().size(), 3 + 3 + 2 * 3);
  for (int k = 1; k < 3; ++k) ekf.Process(FrameOf(0.1 * k, {{2, {0.0, 0.1}}}));
  EXPECT_EQ(ekf.landmarks().size(), 1u);
  EXPECT_EQ(ekf.state().covariance().size(), 3 + 3 + 3);
  for (int k = 3; k < 5; ++k) ekf.Process(FrameOf(0.1 * k, {{3, {0.0, 0.1}}}));
  // Landmark 2 was removed together with its anchor. Landmark 3 came with a new anchor.
  EXPECT_EQ(ekf.landmarks().size(), 1u);
  EXPECT_EQ(ekf.state().covariance().size(), 3 + 3 + 3);
}

TEST(Landmarks, PruningOneLeavesTheRestAsItWouldBeWithIt) {
  constexpr int kSteps = 20;
  Scene scene(kSteps, 3);
  LandmarkOptions pruning;
  pruning.max_missed_frames = 3;
  Ekf with = EkfOf(MapSystem(Offset(0.05), {}, 0.3));
  Ekf without = EkfOf(MapSystem(Offset(0.05), pruning, 0.3));
  int deleted = 0;
  for (int k = 0; k < kSteps; ++k) {
    std::vector<Observation> observations;
    for (int i = 0; i < 3; ++i) {
      if (i != 0 || k < 8) observations.push_back({i, scene.OffsetAt(k, i, 0.05)});
    }
    const Frame frame = FrameOf(0.1 * k, observations);
    with.Process(frame);
    deleted += without.Process(frame).landmarks.deleted;
  }
  EXPECT_EQ(deleted, 1);
  const std::vector<LandmarkEstimate> a = with.landmarks(), b = without.landmarks();
  ASSERT_EQ(a.size(), 3u);
  ASSERT_EQ(b.size(), 2u);
  EXPECT_LT((PositionOf(with) - PositionOf(without)).norm(), 1e-12);
  for (const std::int64_t id : {1, 2}) {
    EXPECT_LT((Find(a, id)->position - Find(b, id)->position).norm(), 1e-12);
    EXPECT_LT((Find(a, id)->covariance - Find(b, id)->covariance).norm(), 1e-12);
  }
}

TEST(Landmarks, BecomeXyzOnceTheyAreLinear) {
  constexpr int kSteps = 30, kPoints = 8, kKnown = 3;
  for (const bool anchored : {false, true}) {
    Scene scene(kSteps, kPoints);
    LandmarkOptions options = WithPrior();
    for (int i = 0; i < kKnown; ++i) {  // the last three points are known and determine the scale
      const Vector3d& p = scene.points[static_cast<std::size_t>(kPoints - 1 - i)];
      options.known.push_back({kPoints - 1 - i, {p[0], p[1], p[2]}, 0.0});
    }
    const auto make = [&] {
      return anchored ? MapSystem(AnchoredPixels<ALIDADE_ROLE_SHARED>(0.002), options)
                      : MapSystem(InverseDepthPixels(0.002), options);
    };
    const auto frame_at = [&scene](int k) {
      std::vector<Observation> observations;
      for (int i = 0; i < kPoints; ++i) observations.push_back({i, scene.PixelAt(k, i, 0.002)});
      return FrameOf(0.1 * k, observations);
    };
    Ekf never = EkfOf(make());
    options.max_linearity_index = 0.1;
    Ekf ekf = EkfOf(make());
    int converted = 0, k = 0;
    for (; k < kSteps && converted == 0; ++k) {
      const Frame frame = frame_at(k);
      never.Process(frame);
      converted = ekf.Process(frame).landmarks.converted;
    }
    ASSERT_GT(converted, 0);
    ASSERT_LT(converted, kPoints - kKnown);
    // Conversion changes no position and no covariance, including those of landmarks that are not
    // converted.
    const std::vector<LandmarkEstimate> before = never.landmarks(), after = ekf.landmarks();
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_LT((before[i].position - after[i].position).norm(), 1e-9);
      EXPECT_LT((before[i].covariance - after[i].covariance).norm(), 1e-9);
    }
    EXPECT_EQ(std::ranges::count_if(after, IsPoint), converted + kKnown);
    // The filter continues. One update now measures landmarks of both representations.
    for (; k < kSteps; ++k) {
      for (const auto& entry : ekf.Process(frame_at(k)).measurements()) {
        EXPECT_EQ(entry.outcome, Outcome::kAccepted);
      }
    }
    EXPECT_EQ(std::ranges::count_if(ekf.landmarks(), IsPoint), kPoints);
    // The anchor was removed together with its last landmark.
    EXPECT_EQ(ekf.state().covariance().size(), 3 + 3 * (kPoints - kKnown));
    for (const LandmarkEstimate& landmark : ekf.landmarks()) {
      const Vector3d error =
          landmark.position - scene.points[static_cast<std::size_t>(landmark.id)];
      EXPECT_LT(error.norm(), 0.1);
    }
  }
}

TEST(Landmarks, ThatComeAndGoKeepStateAndLayoutSmall) {
  LandmarkOptions options = WithPrior();
  options.max_missed_frames = 2;
  options.max_linearity_index = 2.0;
  Ekf ekf = EkfOf(MapSystem(AnchoredPixels<ALIDADE_ROLE_SHARED>(0.002), options));
  Random random(3);
  constexpr int kInView = 10;
  int most_rows = 0, converted = 0;
  std::size_t blocks = 0, values = 0;
  for (int k = 0; k < 5000; ++k) {
    std::vector<Observation> observations;
    for (int i = 0; i < kInView; ++i) {
      // At each step one landmark leaves the view and another enters.
      const int id = k + i;
      const Vector3d p(0.03 * id, 0.3 * (id % 3), 2.0 + 0.2 * (id % 4));
      observations.push_back({id, {(p[0] - 0.03 * k) / p[2], p[1] / p[2]}});
    }
    converted += ekf.Process(FrameOf(0.1 * k, observations)).landmarks.converted;
    most_rows = std::max(most_rows, ekf.state().covariance().size());
    blocks = std::max(blocks, ekf.state().layout().blocks().size());
    values = std::max(values, ekf.state().values().size());
    ASSERT_FALSE(ekf.failed());
  }
  EXPECT_GT(converted, 1000);
  // A landmark remains for two frames after it has left the view, so there are at most 12
  // landmarks. Each has at most three blocks, 6 rows and 7 values. During an initialisation there
  // is one additional landmark.
  EXPECT_LE(ekf.landmarks().size(), std::size_t{kInView + 2});
  EXPECT_LE(most_rows, 3 + 6 * (kInView + 3));
  EXPECT_LE(blocks, std::size_t{1 + 3 * (kInView + 3) + 1});
  EXPECT_LE(values, std::size_t{3 + 10 * (kInView + 3)});
}

TEST(Landmarks, KnownOnesStartAsXyzAndStay) {
  LandmarkOptions options = WithPrior();
  options.max_missed_frames = 1;
  options.known = {
      {1, {0.0, 0.0, 2.0}, 0.0}, {2, {1.0, 0.0, 2.0}, 0.01}, {3, {0.0, 1.0, 2.0}, 0.0}};
  Ekf ekf = EkfOf(MapSystem(InverseDepthPixels(0.001), options, 0.5));
  EXPECT_EQ(ekf.state().covariance().size(), 6);
  // r is the true position of the camera.
  const Vector3d r(0.1, -0.2, 0.3);
  for (int k = 0; k < 10; ++k) {
    std::vector<Observation> observations;
    for (const KnownLandmark& known : options.known) {
      const Vector3d h = Eigen::Map<const Vector3d>(known.position.data()) - r;
      observations.push_back({known.id, {h[0] / h[2], h[1] / h[2]}});
    }
    if (k == 5) observations.pop_back();
    for (const auto& entry : ekf.Process(FrameOf(0.0, observations)).measurements()) {
      EXPECT_EQ(entry.outcome, Outcome::kAccepted);
    }
  }
  EXPECT_LT((PositionOf(ekf) - r).norm(), 0.01);
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ASSERT_EQ(landmarks.size(), 3u);
  EXPECT_EQ(landmarks[0].position, Vector3d(0.0, 0.0, 2.0));
  EXPECT_EQ(landmarks[0].covariance, Eigen::Matrix3d::Zero());
  EXPECT_TRUE(IsPoint(landmarks[1]));
}

// Tests fault 41 of tests/faults/README.md.
TEST(Landmarks, BehindTheCameraAreOutOfDomainAndNoDivergence) {
  Ekf ekf = EkfOf([] {
    LandmarkOptions options = WithPrior();
    options.known = {{1, {0.0, 0.0, -1.0}, 0.1}};
    return MapSystem(InverseDepthPixels(0.01), options, 0.1);
  }());
  const Eigen::MatrixXd p = ekf.state().covariance().Dense();
  for (int k = 0; k < 30; ++k) {
    const UpdateReport& report = ekf.Process(FrameOf(0.0, {{1, {0, 0}}}));
    EXPECT_EQ(OutcomeFor(report, 1), Outcome::kOutOfDomain);
    EXPECT_TRUE(report.events.empty());
  }
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
  EXPECT_FALSE(ekf.diverged());
}

TEST(Landmarks, AreGoneBackToWithTheFilter) {
  constexpr int kSteps = 30, kPoints = 12;
  Scene scene(kSteps, kPoints);
  LandmarkOptions options = WithPrior();
  options.max_missed_frames = 3;
  options.max_linearity_index = 0.1;
  options.min_observations = 2;
  Ekf ekf = EkfOf(MapSystem(AnchoredPixels<ALIDADE_ROLE_SHARED>(0.002), options));
  std::vector<Frame> frames;
  for (int k = 0; k < kSteps; ++k) {
    std::vector<Observation> observations;
    for (int i = 0; i < kPoints; ++i) {
      if (k >= 2 * i && k < 2 * i + 14) observations.push_back({i, scene.PixelAt(k, i, 0.002)});
    }
    frames.push_back(FrameOf(0.1 * k, observations));
  }
  std::unique_ptr<Ekf> middle;
  for (int k = 0; k < kSteps; ++k) {
    if (k == 11) middle = std::make_unique<Ekf>(ekf);
    ekf.Process(frames[static_cast<std::size_t>(k)]);
  }
  const std::vector<double> once = ekf.state().values();
  const MatrixXd p = ekf.state().covariance().Dense();
  const std::vector<LandmarkEstimate> landmarks = ekf.landmarks();
  ekf = *middle;
  for (int k = 11; k < kSteps; ++k) ekf.Process(frames[static_cast<std::size_t>(k)]);
  EXPECT_EQ(ekf.state().values(), once);
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
  ASSERT_EQ(ekf.landmarks().size(), landmarks.size());
  EXPECT_EQ(ekf.landmarks().back().tried, landmarks.back().tried);
}

TEST(Landmarks, ThePriorIsTakenFromTheMapOnceThatHasConverged) {
  LandmarkOptions options = WithPrior(1.0, 0.5);
  options.prior->adapt_after = 3;
  options.known = {{1, {0.0, 0.0, 2.0}, 0.1}, {2, {0.0, 0.1, 4.0}, 0.1}, {3, {0.1, 0.0, 8.0}, 0.1}};
  Ekf ekf = EkfOf(MapSystem(InverseDepthPixels(0.01), options));
  ekf.Process(FrameOf(0.0, {{1, {0, 0}}, {2, {0, 0.025}}, {7, {0.1, 0.1}}}));
  EXPECT_EQ(Find(ekf.landmarks(), 7)->inverse_distance, 1.0);
  ekf.Process(FrameOf(0.0, {{1, {0, 0}}, {2, {0, 0.025}}, {3, {0.0125, 0}}, {8, {0.1, 0.1}}}));
  EXPECT_NEAR(Find(ekf.landmarks(), 8)->inverse_distance, 0.25, 0.01);
}

TEST(Landmarks, AMeasurementThatNamesNoneIsInvalid) {
  Ekf ekf = EkfOf(MapSystem(Offset(0.1), {}));
  EXPECT_EQ(OutcomeFor(ekf.Process(FrameOf(0.0, {{-1, {0, 0, 1}}})), -1), Outcome::kInvalid);
}

}  // namespace
}  // namespace alidade::testing
