// SPDX-License-Identifier: Apache-2.0
//
// Tests 1-point RANSAC on the matches of a frame.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "support/landmark_models.h"
#include "support/systems.h"

namespace alidade::testing {
namespace {

constexpr int kPoints = 40;
constexpr double kNoise = 0.001;

Eigen::Vector3d PointAt(int i) {
  return {0.1 * (i % 8 - 4), 0.1 * (i / 8 - 2), 2.0 + 0.1 * (i % 5)};
}

/// Returns a problem with a known map and a camera. The position of the camera has the standard
/// deviation `sigma_0`.
Problem KnownMap(double sigma_0 = 0.1) {
  LandmarkOptions options = WithPrior();
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d p = PointAt(i);
    options.known.push_back({i, {p[0], p[1], p[2]}, 0.002});
  }
  return MapSystem(InverseDepthPixels(kNoise), options, sigma_0);
}

Ekf Filter(bool ransac, double gate = 0.999, double sigma_0 = 0.1, const RobustLoss& loss = {}) {
  Problem problem = KnownMap(sigma_0);
  problem.sensors[0].loss = loss;
  if (ransac) problem.sensors[0].outlier_rejection = OnePointRansac{};
  EkfOptions gated;
  gated.gate = gate;
  return {problem, gated, {{"tracks", 2}}};
}

/// Returns the matches of a camera at `r`. One in `every` matches is shifted by `aside`, always in
/// the same direction.
Frame Matches(const Eigen::Vector3d& r, int every, double aside) {
  Random random(5);
  std::vector<Observation> observations;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d h = PointAt(i) - r;
    const double u = h[0] / h[2] + kNoise * random.Normal(),
                 v = h[1] / h[2] + kNoise * random.Normal();
    observations.push_back({i, {u + (i % every == 0 ? aside : 0.0), v}});
  }
  return FrameOf(0.0, observations);
}

int Accepted(const UpdateReport& report, int every, bool wrong) {
  int count = 0;
  for (const MeasurementReport& entry : report.measurements()) {
    count += (entry.landmark % every == 0) == wrong && entry.outcome == Outcome::kAccepted;
  }
  return count;
}

TEST(OnePointRansac, LeavesOutWhatTheGateOfEachCannot) {
  const Eigen::Vector3d r(0.05, -0.03, 0.02);
  // The shift of 0.03 is twenty times the noise, but it is within the uncertainty of the camera.
  const Frame frame = Matches(r, 3, 0.03);
  Ekf gate_alone = Filter(false), ekf = Filter(true);
  EXPECT_EQ(Accepted(gate_alone.Process(frame), 3, true), 14);
  const UpdateReport& report = ekf.Process(frame);
  EXPECT_EQ(Accepted(report, 3, true), 0);
  EXPECT_GE(Accepted(report, 3, false), 25);
  EXPECT_GT((PositionOf(gate_alone) - r).norm(), 0.01);
  // The result is the same as if only the correct matches had been measured.
  Frame right = frame;
  std::erase_if(right.measurements, [](const Measurement& m) { return m.landmark % 3 == 0; });
  Ekf told = Filter(false);
  told.Process(right);
  EXPECT_LT((PositionOf(ekf) - PositionOf(told)).norm(), 1e-3);
}

TEST(OnePointRansac, TriesFewerTheMoreAgree) {
  const Eigen::Vector3d r(0.05, -0.03, 0.0);
  Ekf all = Filter(true), some = Filter(true);
  const int few = all.Process(Matches(r, 1000, 0.0)).landmarks.hypotheses;
  const int more = some.Process(Matches(r, 2, 0.05)).landmarks.hypotheses;
  EXPECT_LE(few, 4);
  EXPECT_GT(more, few);
  EXPECT_LT(more, kPoints);
}

// Half of the matches belong to a sensor with a higher `confidence`. The number of hypotheses is
// the same as if all matches belonged to this sensor.
TEST(OnePointRansac, TriesAsManyAsTheMostCautiousSensorAsksFor) {
  const auto hypotheses = [](double first, double second) {
    Problem problem = KnownMap();
    problem.sensors.push_back(problem.sensors[0]);
    problem.sensors[1].name = problem.sensors[1].stream = "more";
    problem.sensors[0].outlier_rejection = OnePointRansac{.confidence = first};
    problem.sensors[1].outlier_rejection = OnePointRansac{.confidence = second};
    Ekf ekf(problem, {}, {{"tracks", 2}, {"more", 2}});
    Frame frame = Matches({0.05, -0.03, 0.0}, 2, 0.05);
    for (std::size_t i = 0; i < frame.measurements.size(); ++i) {
      frame.measurements[i].stream = i < frame.measurements.size() / 2 ? 0 : 1;
    }
    return ekf.Process(frame).landmarks.hypotheses;
  };
  const int few = hypotheses(0.5, 0.5), many = hypotheses(0.9999, 0.9999);
  EXPECT_LT(few, many);
  EXPECT_EQ(hypotheses(0.5, 0.9999), many);
  EXPECT_EQ(hypotheses(0.9999, 0.5), many);
}

TEST(OnePointRansac, RescuesWhatFitsTheUpdatedState) {
  // A single match does not determine the forward motion of the camera, so the residuals of the
  // other matches exceed the noise.
  const Frame frame = Matches({0.05, -0.03, 0.08}, 1000, 0.0);
  Ekf ekf = Filter(true);
  const UpdateReport& report = ekf.Process(frame);
  EXPECT_GT(report.landmarks.rescued, 0);
  const auto accepted =
      std::ranges::count(report.measurements(), Outcome::kAccepted, &MeasurementReport::outcome);
  EXPECT_GE(accepted, kPoints - 2);
  // Each match is used only once, so P agrees with the error.
  const Eigen::Vector3d error = PositionOf(ekf) - Eigen::Vector3d(0.05, -0.03, 0.08);
  const Eigen::MatrixXd p = ekf.state().covariance().Block(0, 3, 0, 3);
  EXPECT_LT(error.dot(p.llt().solve(error)), 16.3);  // the bound is chi2(0.999, 3)
}

// The R / w of a Cauchy loss grows as fast as r^2. If the test used R / w, any match would support
// any hypothesis. In the update the inliers are weighted, here with weights below 1.
TEST(OnePointRansac, TestsAgainstTheSensorsNoiseWhateverTheLoss) {
  const RobustLoss loss{LossKind::kCauchy, 1.0};
  const Eigen::Vector3d r(0.001, 0.0, 0.0);
  const Frame frame = Matches(r, 3, 0.03);
  Ekf ekf = Filter(true, 1.0, 0.001, loss), told = Filter(false, 1.0, 0.001, loss);
  const UpdateReport& report = ekf.Process(frame);
  EXPECT_EQ(Accepted(report, 3, true), 0);
  EXPECT_GE(Accepted(report, 3, false), 25);
  Frame right = frame;
  std::erase_if(right.measurements, [&](const Measurement& m) {
    const auto entry =
        std::ranges::find(report.measurements(), m.landmark, &MeasurementReport::landmark);
    return entry->outcome != Outcome::kAccepted;
  });
  told.Process(right);
  EXPECT_LT((PositionOf(ekf) - PositionOf(told)).norm(), 2e-5);
  Ekf plain = Filter(false, 1.0, 0.001);
  plain.Process(right);
  EXPECT_GT((PositionOf(plain) - PositionOf(told)).norm(), 5e-5);
}

// The threshold for rescuing a match does not depend on the threshold for supporting a hypothesis.
TEST(OnePointRansac, RescuesByItsOwnThreshold) {
  const Frame frame = Matches({0.05, -0.03, 0.08}, 1000, 0.0);
  int rescued[2];
  for (const int strict : {0, 1}) {
    Problem problem = KnownMap();
    problem.sensors[0].outlier_rejection =
        OnePointRansac{.rescue_probability = strict == 1 ? 1e-6 : 0.99};
    rescued[strict] = EkfOf(problem).Process(frame).landmarks.rescued;
  }
  EXPECT_GT(rescued[0], 0);
  EXPECT_EQ(rescued[1], 0);
}

// Sensor `z` has no outlier rejection and no gate. The measurement of this sensor is used even if
// it is far from the prediction.
TEST(OnePointRansac, LeavesSensorsAloneThatDoNotAskForIt) {
  Problem problem = KnownMap();
  problem.sensors[0].outlier_rejection = OnePointRansac{};
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 0.1}});
  AddSensor(problem, "z", LinearSensor(1.0, 0.1), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Frame frame = Matches({0.05, -0.03, 0.0}, 1000, 0.0);
  frame.measurements.push_back({0, 1, -1, {2.0}, {}});
  const UpdateReport& report = ekf.Process(frame);
  EXPECT_EQ(report.measurements().back().outcome, Outcome::kAccepted);
  EXPECT_NEAR(ValueOf(ekf.state(), "p.x"), 1.0, 1e-12);
}

// The huge measurement overflows. The update with the inliers then fails and is rolled back, so
// there is no corrected state that other matches could fit.
TEST(OnePointRansac, RescuesNothingAfterAnUpdateThatIsRolledBack) {
  for (const bool overflows : {false, true}) {
    Problem problem = KnownMap();
    problem.sensors[0].outlier_rejection = OnePointRansac{};
    AddMotion(problem, "far", testing::ConstantMotion(1), {{"x", 1.5e308, 1.0}});
    AddSensor(problem, "z", LinearSensor(0.1, 0.3), {"far.x"});
    Ekf ekf(problem, {}, StreamsOf(problem));
    const std::vector<double> before = ekf.state().values();
    Frame frame = Matches({0.05, -0.03, 0.08}, 1000, 0.0);
    frame.measurements.push_back({0, 1, -1, {overflows ? 5e307 : 1.5e307}, {}});
    const UpdateReport& report = ekf.Process(frame);
    EXPECT_EQ(report.landmarks.rescued > 0, !overflows);
    EXPECT_EQ(ekf.state().values() == before, overflows);
    std::ptrdiff_t count[kOutcomes.size()] = {};
    for (const MeasurementReport& one : report.measurements())
      ++count[static_cast<int>(one.outcome)];
    EXPECT_EQ(count[static_cast<int>(Outcome::kNotFinite)] == kPoints + 1, overflows);
    EXPECT_EQ(count[static_cast<int>(Outcome::kAccepted)] == 0, overflows);
  }
}

// The threshold is so strict that no match meets it. All hypotheses are tried, and none has an
// inlier. All matches fit the prior state, so they are rescued.
TEST(OnePointRansac, AgreesByItsOwnThreshold) {
  Problem problem = KnownMap();
  problem.sensors[0].outlier_rejection = OnePointRansac{.inlier_probability = 1e-9};
  Ekf ekf = EkfOf(problem);
  const UpdateReport& report = ekf.Process(Matches({0.05, -0.03, 0.0}, 1000, 0.0));
  EXPECT_EQ(report.landmarks.hypotheses, kPoints);
  EXPECT_EQ(report.landmarks.rescued, kPoints);
}

// The camera is a consider state, so no match corrects it. No hypothesis explains the offset of
// 0.05 m, which is 25 times the noise. Afterwards all matches are rescued, because the camera is
// uncertain.
TEST(OnePointRansac, AHypothesisDoesNotMoveWhatIsConsidered) {
  const Frame frame = Matches({0.05, -0.03, 0.0}, 1000, 0.0);
  for (const bool by_role : {false, true}) {
    Problem problem = KnownMap();
    problem.sensors[0].outlier_rejection = OnePointRansac{};
    if (by_role) {
      problem.sensors[0].roles[0].mode = RoleMode::kConsider;
    } else {
      problem = WithStatus(problem, "", BlockStatus::kConsider);
    }
    Ekf ekf = EkfOf(problem);
    const UpdateReport& report = ekf.Process(frame);
    EXPECT_EQ(report.landmarks.hypotheses, kPoints) << by_role;
    EXPECT_EQ(report.landmarks.rescued, kPoints) << by_role;
    EXPECT_EQ(PositionOf(ekf), Eigen::Vector3d::Zero()) << by_role;
  }
}

// All points were initialised from one camera position, so they share the uncertainty of this
// position. Sensor `held` treats the position as known. All points of this sensor are shifted by
// 0.1 m: one match corrects all of these points, and all matches agree.
TEST(OnePointRansac, AHypothesisIsSeenFromWhereARoleIsHeld) {
  Problem problem = MapSystem(Offset(0.01), {}, 0.3);
  SensorBinding held = problem.sensors[0];
  held.name = held.stream = "held";
  held.roles[0].mode = RoleMode::kKnown;
  held.outlier_rejection = OnePointRansac{};
  problem.sensors.push_back(held);
  Ekf ekf(problem, {}, {{"tracks", 3}, {"held", 3}});
  std::vector<Observation> seen, aside;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d p = PointAt(i);
    seen.push_back({i, {p[0], p[1], p[2]}});
    aside.push_back({i, {p[0] + 0.1, p[1], p[2]}});
  }
  EXPECT_EQ(ekf.Process(FrameOf(0.0, seen)).landmarks.initialised, 10);
  Frame frame = FrameOf(0.0, aside);
  for (Measurement& m : frame.measurements) m.stream = 1;
  const UpdateReport& report = ekf.Process(frame);
  EXPECT_EQ(report.landmarks.hypotheses, 1);
  EXPECT_EQ(report.landmarks.rescued, 0);
  for (const MeasurementReport& entry : report.measurements()) {
    EXPECT_EQ(entry.outcome, Outcome::kAccepted);
  }
}

TEST(OnePointRansac, IsTheSameTwice) {
  const Frame frame = Matches({0.05, -0.03, 0.02}, 3, 0.03);
  Ekf a = Filter(true), b = Filter(true);
  a.Process(frame);
  b.Process(frame);
  EXPECT_EQ(a.state().values(), b.state().values());
}

}  // namespace
}  // namespace alidade::testing
