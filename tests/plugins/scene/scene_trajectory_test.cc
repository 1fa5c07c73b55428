// SPDX-License-Identifier: Apache-2.0
//
// Tests curves through way-points and key frames, and the trajectories that use these curves.
#include <Eigen/Geometry>
#include <cmath>

#include "motion_models/odometry_pose.h"
#include "plugins/scene/curves.h"
#include "scene_fixture.h"

namespace alidade::testing {
namespace {

using Eigen::Vector3d;

const std::vector<double> kTimes{0.0, 0.7, 1.0, 2.5};  // the intervals are unequal

Quaternion Turned(double x, double y, double z) {
  const double d[3] = {x, y, z};
  Quaternion q;
  UnitQuaternion::Exp(d, q.data());
  return q;
}

/// Returns Log(a^-1 b).
Vector3d Difference(const Quaternion& b, const Quaternion& a) {
  Vector3d d;
  UnitQuaternion::Minus(b.data(), a.data(), d.data());
  return d;
}

std::vector<Vector3d> Points() { return {{0, 0, 0}, {1, -2, 3}, {2, 0, 1}, {-1, 1, 1}}; }
std::vector<Quaternion> Rotations() {
  return {Turned(0, 0, 0), Turned(0.4, 0.2, -0.3), Turned(1.2, 0.1, 0.5), Turned(0.3, -1, 0.7)};
}

TEST(CubicSpline, PassesThroughItsPoints) {
  const CubicSpline spline(kTimes, Points());
  for (std::size_t i = 0; i < kTimes.size(); ++i) {
    EXPECT_LT((spline.At(kTimes[i]) - Points()[i]).norm(), 1e-14);
  }
}

TEST(CubicSpline, SlopeAndCurvatureAreContinuousAndVanishAtTheEnds) {
  // Compares differences over h on both sides of each knot. A jump of the slope would change the
  // first differences, and a jump of the curvature would change the second differences. The third
  // derivative is below 200, so it contributes 0.02 for h = 1e-4.
  const CubicSpline spline(kTimes, Points());
  constexpr double h = 1e-4;
  const auto second = [&](double t) {
    return Vector3d((spline.At(t + h) - 2.0 * spline.At(t) + spline.At(t - h)) / (h * h));
  };
  for (const double t : {0.7, 1.0}) {
    const Vector3d left = (spline.At(t) - spline.At(t - h)) / h;
    const Vector3d right = (spline.At(t + h) - spline.At(t)) / h;
    EXPECT_LT((right - left).norm(), 100.0 * h);
    EXPECT_LT((second(t + 2.0 * h) - second(t - 2.0 * h)).norm(), 0.1);
    EXPECT_GT(second(t).norm(), 5.0);  // otherwise the next checks would be trivial
  }
  EXPECT_LT(second(0.0 + h).norm(), 0.1);
  EXPECT_LT(second(2.5 - h).norm(), 0.1);
}

TEST(CubicSpline, IsTheNaturalSplineOfTheTextbook) {
  // The points 0, 1, 0 at the times 0, 1, 2 lead to M1 = -3 and y(0.5) = 11/16.
  const CubicSpline spline({0, 1, 2}, {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});
  EXPECT_NEAR(spline.At(0.5).x(), 11.0 / 16.0, 1e-15);
  EXPECT_NEAR(spline.At(1.5).x(), 11.0 / 16.0, 1e-15);
}

TEST(CubicSpline, OfTwoPointsIsALineAndOfOneStandsStill) {
  const CubicSpline line({0, 2}, {{0, 0, 0}, {2, 4, 6}});
  EXPECT_LT((line.At(0.5) - Vector3d(0.5, 1, 1.5)).norm(), 1e-15);
  EXPECT_LT((line.At(-1.0) - Vector3d(-1, -2, -3)).norm(), 1e-14);  // linear extrapolation
  EXPECT_EQ(CubicSpline({0}, {{1, 2, 3}}).At(7.0), Vector3d(1, 2, 3));
}

TEST(RotationCurve, PassesThroughItsKeyFrames) {
  const RotationCurve curve(kTimes, Rotations());
  for (std::size_t i = 0; i < kTimes.size(); ++i) {
    EXPECT_LT(Difference(curve.At(kTimes[i]), Rotations()[i]).norm(), 1e-14);
  }
}

TEST(RotationCurve, AngularVelocityIsContinuousAtUnevenTimes) {
  const RotationCurve curve(kTimes, Rotations());
  constexpr double h = 1e-5;
  for (std::size_t i = 1; i + 1 < kTimes.size(); ++i) {
    const double t = kTimes[i];
    const Vector3d before = Difference(curve.At(t), curve.At(t - h)) / h;
    const Vector3d after = Difference(curve.At(t + h), curve.At(t)) / h;
    EXPECT_LT((after - before).norm(), 1e-3);
    EXPECT_GT(before.norm(), 0.5);
  }
}

TEST(RotationCurve, OfTwoKeyFramesIsASlerp) {
  const Quaternion a = Turned(0.1, 0.2, 0.3), b = Turned(-1.0, 0.4, 2.0);
  const RotationCurve curve({0, 2}, {a, b});
  for (const double s : {0.0, 0.1, 0.5, 0.9, 1.0}) {
    const Vector3d turn = s * Difference(b, a);
    Quaternion expected;
    UnitQuaternion::Plus(a.data(), turn.data(), expected.data());
    EXPECT_LT(Difference(curve.At(2.0 * s), expected).norm(), 1e-14) << s;
  }
}

TEST(RotationCurve, TakesQAndMinusQForOne) {
  std::vector<Quaternion> flipped = Rotations();
  for (double& value : flipped[1]) value = -value;
  const RotationCurve curve(kTimes, Rotations()), other(kTimes, flipped);
  for (const double t : {0.3, 0.7, 0.8, 2.0}) {
    EXPECT_LT(Difference(other.At(t), curve.At(t)).norm(), 1e-14);
  }
}

// ---- paths --------------------------------------------------------------------------------------

Vector3d Rotated(const std::vector<double>& q, const Vector3d& x) {
  Vector3d y;
  UnitQuaternion::Rotate(q.data(), x.data(), y.data());
  return y;
}

TEST(ScenePath, LooksAtItsTargetWithTheHorizonLevel) {
  const auto frames = SceneFrames("max_frames: 31, " + kPoints + ", " + kSweep);
  const std::vector<double> q = frames.front().truth[1];
  // The camera looks from (-0.5, 0, 0) to (0, 0, 4).
  EXPECT_LT((Rotated(q, Vector3d::UnitZ()) - Vector3d(0.5, 0, 4).normalized()).norm(), 1e-14);
  for (const SourceFrame& frame : frames) {
    const Vector3d right = Rotated(frame.truth[1], Vector3d::UnitX());
    const Vector3d down = Rotated(frame.truth[1], Vector3d::UnitY());
    EXPECT_NEAR(right.y(), 0.0, 1e-14);
    EXPECT_GT(right.x(), 0.9);
    EXPECT_GT(down.y(), 0.9);  // y points down both in the world and in the camera
  }
  const auto& last = frames.back().truth;
  EXPECT_LT((Vector3d(last[0].data()) - Vector3d(0.5, 0.1, 0.2)).norm(), 1e-14);
}

TEST(ScenePath, EveryFormOfAnOrientationSaysTheSame) {
  // A camera that is rotated by 90 degrees about y looks along x.
  const auto ahead = [](const std::string& orientation) {
    const auto frames =
        SceneFrames("max_frames: 1, " + kPoints +
                    ", trajectory: {keyframes: [{position: [1, 2, 3], " + orientation + "}]}");
    EXPECT_EQ(frames.at(0).truth[0], (std::vector<double>{1, 2, 3}));
    return Rotated(frames[0].truth[1], Vector3d::UnitZ());
  };
  for (const char* form : {"rpy_deg: [0, 90, 0]", "matrix: [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]",
                           "axis_angle_deg: [0, 2, 0, 90]",
                           "quaternion: {w: 0.70710678, x: 0, y: 0.70710678, z: 0}"}) {
    EXPECT_LT((ahead(form) - Vector3d::UnitX()).norm(), 1e-7) << form;
  }
  // In Rz(90) Ry(0) Rx(90), the rotation about x maps z to -y. The rotation about z maps -y to x.
  EXPECT_LT((ahead("rpy_deg: [90, 0, 90]") - Vector3d::UnitX()).norm(), 1e-15);
}

TEST(ScenePath, VelocitiesLeadFromFrameToFrameAsQuaternionPoseHasIt) {
  for (const std::string& path :
       {kSweep,
        std::string("trajectory: {keyframes: [{position: [0, 0, 0], rpy_deg: [0, 0, 0]}, "
                    "{position: [1, 0, 1], rpy_deg: [10, 20, 30]}, "
                    "{position: [0, 1, 1], rpy_deg: [40, 0, -30]}]}"),
        std::string("trajectory: {random: {linear_acceleration: 3, angular_acceleration: "
                    "[1, 2, 3], velocity: [0.4, 0, 0], angular_velocity: [0, 1, 0]}}")}) {
    const auto frames = SceneFrames("max_frames: 50, rate_hz: 20, " + kPoints + ", " + path);
    for (std::size_t k = 1; k < frames.size(); ++k) {
      const auto &before = frames[k - 1].truth, &now = frames[k].truth;
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(before[0][i] + 0.05 * now[2][i], now[0][i], 1e-14);
      }
      const Vector3d turn = 0.05 * Vector3d(now[3].data());
      Quaternion q, q1;
      std::copy_n(now[1].begin(), 4, q.begin());
      UnitQuaternion::Plus(before[1].data(), turn.data(), q1.data());
      EXPECT_LT(Difference(q1, q).norm(), 1e-14);
    }
  }
}

TEST(ScenePath, DrawnFromTheModelHasItsAccelerations) {
  // The differences of 5000 steps have standard deviations accurate to 1 / sqrt(2 * 5000) = 1 %.
  // Tolerances are 4 sigma.
  const auto frames = SceneFrames("max_frames: 5001, rate_hz: 10, " + kPoints +
                                  ", trajectory: {random: {linear_acceleration: [0.3, 0.6, 0], "
                                  "angular_acceleration: 0.05}}");
  double linear[3] = {}, angular[3] = {};
  for (std::size_t k = 1; k < frames.size(); ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      linear[i] += std::pow(10 * (frames[k].truth[2][i] - frames[k - 1].truth[2][i]), 2) / 5000;
      angular[i] += std::pow(10 * (frames[k].truth[3][i] - frames[k - 1].truth[3][i]), 2) / 5000;
    }
  }
  EXPECT_NEAR(std::sqrt(linear[0]), 0.3, 0.04 * 0.3);
  EXPECT_NEAR(std::sqrt(linear[1]), 0.6, 0.04 * 0.6);
  EXPECT_EQ(linear[2], 0.0);
  for (const double one : angular) EXPECT_NEAR(std::sqrt(one), 0.05, 0.04 * 0.05);
}

TEST(ScenePath, OdometryLeadsAlongTheTruth) {
  const auto frames =
      SceneFrames("max_frames: 100, simulate_odometry: true, " + kPoints +
                  ", trajectory: {random: {linear_acceleration: 3, angular_acceleration: 3}}");
  const OdometryPose model(NoiseKind::kDiscrete, {}, {});
  std::vector<double> r = frames[0].truth[0], q = frames[0].truth[1];
  const double still[6] = {};
  for (std::size_t k = 0; k + 1 < frames.size(); ++k) {
    const Measurement& odometry = frames[k].measurements.back();
    ASSERT_EQ(odometry.stream, 1);
    std::vector<double> r1(3), q1(4), parameters(8);
    const double nothing[3] = {}, no_turn[4] = {1, 0, 0, 0};
    model.Step(r.data(), q.data(), nothing, no_turn, nothing, odometry.values.data(), still,
               1.0 / 30.0, r1.data(), q1.data(), &parameters[0], &parameters[3], &parameters[7]);
    r = r1;
    q = q1;
  }
  const auto& last = frames.back().truth;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(r[i], last[0][i], 1e-12);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(q[i], last[1][i], 1e-12);
  // The last frame has no odometry.
  for (const Measurement& m : frames.back().measurements) EXPECT_NE(m.stream, 1);
}

}  // namespace
}  // namespace alidade::testing
