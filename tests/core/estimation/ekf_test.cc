// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ekf.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "alidade/base/random.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Textbook Kalman filter of MovingPoint: x' = F x, P' = F P F' + G q G'. The update computes the
/// inverse of S.
struct Textbook {
  Eigen::Vector2d x{1.0, -0.5};
  Eigen::Matrix2d p = Eigen::Vector2d(4.0, 9.0).asDiagonal();
  void Step(double dt, double sigma) {
    Eigen::Matrix2d f;
    f << 1.0, dt, 0.0, 1.0;
    const Eigen::Vector2d g(0.5 * dt * dt, dt);
    x = f * x;
    p = f * p * f.transpose() + sigma * sigma * g * g.transpose();
  }
  void Update(const Eigen::MatrixXd& h, const Eigen::VectorXd& z, const Eigen::MatrixXd& r) {
    const Eigen::MatrixXd s = h * p * h.transpose() + r;
    const Eigen::MatrixXd k = p * h.transpose() * s.inverse();
    x += k * (z - h * x);
    p = (Eigen::Matrix2d::Identity() - k * h) * p;
  }
};

Problem TwoSensors() {
  Problem problem = MovingPoint();
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  AddSensor(problem, "doubled", LinearSensor(2.0, 0.7), {"p.x"});
  return problem;
}

TEST(Ekf, EqualsTheClosedFormKalmanFilterOnALinearProblem) {
  const Problem problem = TwoSensors();
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Start(0);
  Textbook textbook;
  Random random(11);
  Eigen::MatrixXd h(2, 2);
  h << 1.0, 0.0, 2.0, 0.0;
  const Eigen::MatrixXd r = Eigen::Vector2d(0.09, 0.49).asDiagonal();
  double t = 0.0;
  for (int k = 1; k <= 200; ++k) {
    const double dt = k % 3 == 0 ? 0.05 : 0.033;
    t += dt;
    const Eigen::Vector2d z(random.Normal(), random.Normal());
    ekf.Process(FrameAt(t, {{0, z[0]}, {1, z[1]}}));
    textbook.Step(Seconds(TimestampFromSeconds(t)) - Seconds(TimestampFromSeconds(t - dt)), 1.0);
    textbook.Update(h, z, r);
    ASSERT_NEAR(ValueOf(ekf.state(), "p.x"), textbook.x[0], 1e-10) << k;
    ASSERT_NEAR(ValueOf(ekf.state(), "p.v"), textbook.x[1], 1e-10) << k;
    ASSERT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.x"), textbook.p(0, 0), 1e-10) << k;
    ASSERT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.v"), textbook.p(0, 1), 1e-10) << k;
    ASSERT_NEAR(CovarianceOf(ekf.state(), "p.v", "p.v"), textbook.p(1, 1), 1e-10) << k;
  }
}

TEST(Ekf, JointEqualsSequentialOnALinearProblem) {
  const Problem problem = TwoSensors();
  EkfOptions per_sensor, per_measurement;
  per_sensor.fuse = Fuse::kPerSensor;
  per_measurement.fuse = Fuse::kPerMeasurement;
  Ekf joint(problem, {}, StreamsOf(problem)), sensors(problem, per_sensor, StreamsOf(problem)),
      measurements(problem, per_measurement, StreamsOf(problem));
  Random random(12);
  for (int k = 0; k < 200; ++k) {
    // The frame has two measurements of the first stream and one of the second.
    const Frame frame =
        FrameAt(0.033 * k, {{0, random.Normal()}, {1, random.Normal()}, {0, random.Normal()}});
    for (Ekf* ekf : {&joint, &sensors, &measurements}) ekf->Process(frame);
    for (const Ekf* ekf : {&sensors, &measurements}) {
      ASSERT_NEAR(ValueOf(ekf->state(), "p.x"), ValueOf(joint.state(), "p.x"), 1e-10) << k;
      ASSERT_NEAR(ValueOf(ekf->state(), "p.v"), ValueOf(joint.state(), "p.v"), 1e-10) << k;
      ASSERT_LT((ekf->state().covariance().Dense() - joint.state().covariance().Dense()).norm(),
                1e-10);
    }
  }
}

// Tests fault 80 of tests/faults/README.md.
TEST(Ekf, AnOutlierIsGatedAndLeavesStateAndCovarianceBitForBit) {
  const Problem problem = DepthFilter();
  EkfOptions options;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  ekf.Process(FrameAt(0.0, {{0, 80.0}, {1, 1.0}}));
  const std::vector<double> x = ekf.state().values();
  const Eigen::MatrixXd p = ekf.state().covariance().Dense();
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 1e9}}));
  ASSERT_EQ(report.measurements().size(), 1u);
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kGated);
  EXPECT_GT(report.measurements()[0].nis, 1e9);
  EXPECT_EQ(ekf.state().values(), x);
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
}

TEST(Ekf, TheGatePassesTheShareThatItsProbabilityStates) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 1e-9}});
  AddSensor(problem, "direct", LinearSensor(1.0, 1.0), {"p.x"});
  EkfOptions options;
  options.gate = 0.9;
  options.rejection_recovery = RejectionRecovery::kNone;
  Ekf ekf(problem, options, StreamsOf(problem));
  Random random(13);
  constexpr int kTrials = 20000;
  int passed = 0;
  for (int k = 0; k < kTrials; ++k) {
    const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, random.Normal()}}));
    passed += report.measurements()[0].outcome == Outcome::kAccepted ? 1 : 0;
  }
  // The tolerance is 5 sigma of a binomial proportion.
  EXPECT_NEAR(passed / double{kTrials}, 0.9, 5.0 * std::sqrt(0.9 * 0.1 / kTrials));
}

TEST(Ekf, PerSensorHoldsWhereTheLastMeasurementOfASensorIsNotUsed) {
  // d = BF / Z is not linear, so joint and per-sensor updates give different results.
  const Problem problem = DepthFilter();
  EkfOptions options;
  options.fuse = Fuse::kPerSensor;
  Ekf whole(problem, options, StreamsOf(problem)),
      with_invalid(problem, options, StreamsOf(problem));
  whole.Process(FrameAt(0.0, {{0, 80.0}, {1, 1.0}}));
  const UpdateReport& report = with_invalid.Process(FrameAt(0.0, {{0, 80.0}, {0, -1.0}, {1, 1.0}}));
  EXPECT_EQ(report.measurements()[1].outcome, Outcome::kInvalid);
  EXPECT_EQ(with_invalid.state().values(), whole.state().values());
  Ekf joint(problem, {}, StreamsOf(problem));
  joint.Process(FrameAt(0.0, {{0, 80.0}, {1, 1.0}}));
  EXPECT_NE(joint.state().values(), whole.state().values());
}

/// Measures z = x + gain c.
struct Biased : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"c"}};
  static constexpr Quantity kMeasurement{"z"};
  double gain, sigma;
  Biased(double g, double s) : gain(g), sigma(s) {}
  template <class T>
  bool Predict(const T* x, const T* c, T* z) const {
    z[0] = x[0] + gain * c[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(sigma);
  }
};

// Two updates in Joseph form have three rows each. If c is a consider state, its gain is zero for
// all rows. If only one sensor considers c, its gain is zero for the rows of that sensor.
TEST(Ekf, AnUpdateOfSeveralRowsIsSchmidtsWhereABlockIsConsidered) {
  for (const bool by_role : {false, true}) {
    Problem problem;
    AddMotion(problem, "x", testing::ConstantMotion(1), {{"x", 1.0, 1.5}});
    AddMotion(problem, "c", testing::ConstantMotion(1), {{"x", 0.5, 0.8}});
    if (!by_role) problem = WithStatus(problem, "c.x", BlockStatus::kConsider);
    const Eigen::Vector3d gains(1.0, -0.5, 2.0), sigmas(0.3, 0.2, 0.5);
    for (int i = 0; i < 3; ++i) {
      AddSensor(problem, "z" + std::to_string(i), MakeSensor(Biased(gains[i], sigmas[i]), "biased"),
                {"x.x", "c.x"});
    }
    if (by_role) problem.sensors[1].roles[1].mode = RoleMode::kConsider;
    Ekf ekf(problem, {}, StreamsOf(problem));
    Eigen::Vector2d x(1.0, 0.5);
    Eigen::Matrix2d p = Eigen::Vector2d(1.5 * 1.5, 0.8 * 0.8).asDiagonal();
    const Eigen::Matrix3d r = sigmas.cwiseAbs2().asDiagonal();
    Eigen::Matrix<double, 3, 2> h;
    h << Eigen::Vector3d::Ones(), gains;
    for (const double shift : {0.0, 0.4}) {
      const Eigen::Vector3d z(2.0 + shift, 1.1 - shift, 2.5);
      ekf.Process(FrameAt(0.0, {{0, z[0]}, {1, z[1]}, {2, z[2]}}));
      Eigen::Matrix<double, 2, 3> k = p * h.transpose() * (h * p * h.transpose() + r).inverse();
      if (by_role) {
        k(1, 1) = 0.0;
      } else {
        k.row(1).setZero();
      }
      x += k * (z - h * x);
      const Eigen::Matrix2d a = Eigen::Matrix2d::Identity() - k * h;
      p = (a * p * a.transpose() + k * r * k.transpose()).eval();
      EXPECT_NEAR(ValueOf(ekf.state(), "x.x"), x[0], 1e-12) << by_role;
      EXPECT_NEAR(ValueOf(ekf.state(), "c.x"), x[1], 1e-12) << by_role;
      EXPECT_LT((ekf.state().covariance().Dense() - p).norm(), 1e-12) << by_role;
    }
  }
}

/// Measures z = x. The implied x exists only if z is positive.
struct Implies : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  static constexpr int kInitialises = 0;
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
  template <class T>
  bool Initialise(const T* z, T* x) const {
    if (!(z[0] > T(0.0))) return false;
    x[0] = z[0];
    return true;
  }
};

// A measurement that implies no state is invalid. It does not count as a divergence of the filter.
TEST(Ekf, AMeasurementThatImpliesNoValueToLineariseAtIsInvalid) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 1.0, 1.0}});
  AddSensor(problem, "z", MakeSensor(Implies(), "implies"), {"p.x"});
  problem.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  Ekf ekf(problem, {}, StreamsOf(problem));
  for (int k = 0; k < 25; ++k) {
    const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, -1.0}}));
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kInvalid);
    EXPECT_TRUE(report.events.empty());
  }
  EXPECT_FALSE(ekf.diverged());
  EXPECT_EQ(ekf.Process(FrameAt(0.0, {{0, 1.5}})).measurements()[0].outcome, Outcome::kAccepted);
}

// A quaternion has three degrees of freedom, so the gate is chi2(0.95, 3) = 7.81. If the gate
// counted the four elements, it would be chi2(0.95, 4) = 9.49.
TEST(Ekf, TheGateCountsDegreesOfFreedomNotNumbers) {
  const Problem problem = WalkingOrientation();
  EkfOptions options;
  options.gate = 0.95;
  const auto outcome_at = [&](double nis) {
    Ekf ekf(problem, options, StreamsOf(problem));
    const double angle = std::sqrt(nis * (0.01 + 0.0025));
    Frame frame = FrameAt(0.0, {});
    frame.measurements.push_back(
        {0, 0, -1, {std::cos(0.5 * angle), std::sin(0.5 * angle), 0.0, 0.0}, {}});
    return ekf.Process(frame).measurements()[0].outcome;
  };
  EXPECT_EQ(outcome_at(7.6), Outcome::kAccepted);
  EXPECT_EQ(outcome_at(8.6), Outcome::kGated);
}

TEST(Ekf, ConsideredBlocksKeepTheirValueAndTheirCorrelationsFollowSchmidt) {
  // z = lambda Z, and lambda is a consider state. The expected Schmidt gain is computed by hand.
  Problem problem = DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  problem.sensors[0].roles[1].mode = RoleMode::kConsider;
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Start(0);
  ekf.Process(FrameAt(0.0, {{0, 1.1}}));
  const double z = 0.35, lambda = 3.3, h = z * lambda;
  // The elements of the state are depth, depth_rate and inverse_distance.
  const Eigen::RowVector3d jacobian(lambda, 0.0, z);
  const Eigen::Matrix3d p = Eigen::Vector3d(0.01, 0.25, 0.25).asDiagonal();
  const double sigma = 2.0 / 300.0 * h * h * h, r = sigma * sigma;
  const double s = jacobian * p * jacobian.transpose() + r;
  Eigen::Vector3d k = p * jacobian.transpose() / s;
  k[2] = 0.0;
  const Eigen::Matrix3d m = Eigen::Matrix3d::Identity() - k * jacobian;
  const Eigen::Matrix3d expected = m * p * m.transpose() + k * r * k.transpose();
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth"), z + k[0] * (1.1 - h), 1e-14);
  EXPECT_EQ(ValueOf(ekf.state(), "template.inverse_distance"), lambda);
  EXPECT_LT((ekf.state().covariance().Dense() - expected).norm(), 1e-14);
}

TEST(Ekf, HeldRolesHaveNoJacobian) {
  Problem problem = DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  problem.sensors[0].roles[1].mode = RoleMode::kKnown;
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 1.1}}));
  const double z = 0.35, lambda = 3.3, h = z * lambda, sigma = 2.0 / 300.0 * h * h * h;
  EXPECT_NEAR(report.measurements()[0].s[0], lambda * lambda * 0.01 + sigma * sigma, 1e-15);
  EXPECT_EQ(ValueOf(ekf.state(), "template.inverse_distance"), lambda);
  EXPECT_EQ(CovarianceOf(ekf.state(), "template.inverse_distance", "template.inverse_distance"),
            0.25);
}

TEST(Ekf, LinearisedAtTheMeasurementTheJacobianIsThatOfTheMeasuredDepth) {
  Problem problem = DepthFilter();
  problem.sensors.pop_back();
  problem.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  Ekf ekf(problem, {}, StreamsOf(problem));
  const double d = 80.0, bf = 26.0;
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, d}}));
  // H1 = -d^2 / BF is evaluated at the measurement. The innovation is evaluated at the prediction.
  const double jacobian = -d * d / bf;
  EXPECT_NEAR(report.measurements()[0].s[0], jacobian * jacobian * 0.01 + 1.0, 1e-9);
  EXPECT_NEAR(report.measurements()[0].innovation[0], d - bf / 0.35, 1e-12);
}

TEST(Ekf, ASensorOutsideItsDomainIsReportedAsDivergenceOnce) {
  Problem problem = DepthFilter();
  problem.priors[0].mean = {-0.2};
  EkfOptions options;
  options.rejection_recovery = RejectionRecovery::kNone;
  Ekf ekf(problem, options, StreamsOf(problem));
  int events = 0;
  for (int k = 0; k < 5; ++k) {
    const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 80.0}}));
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kOutOfDomain);
    events += static_cast<int>(report.events.size());
  }
  EXPECT_EQ(events, 1);
  EXPECT_TRUE(ekf.diverged());
  EXPECT_EQ(ValueOf(ekf.state(), "target.depth"), -0.2);
}

// Tests fault 73 of tests/faults/README.md.
// 1e-200 squared is zero, so the measurement is exact.
TEST(Ekf, NoiseThatVanishesIsAnExactMeasurement) {
  Problem problem = MovingPoint();
  AddSensor(problem, "direct", LinearSensor(1.0, 1e-200), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport first = ekf.Process(FrameAt(0.0, {{0, 1.0}}));
  EXPECT_TRUE(first.events.empty());
  EXPECT_EQ(first.measurements()[0].outcome, Outcome::kAccepted);
  EXPECT_EQ(CovarianceOf(ekf.state(), "p.x", "p.x"), 0.0);
  EXPECT_TRUE(ekf.Process(FrameAt(0.1, {{0, 1.0}})).events.empty());
}

TEST(Ekf, FramesOfThePastAreStale) {
  const Problem problem = DepthFilter();
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Process(FrameAt(1.0, {{0, 80.0}}));
  const std::vector<double> x = ekf.state().values();
  EXPECT_EQ(ekf.Process(FrameAt(0.5, {{0, 80.0}})).measurements()[0].outcome, Outcome::kStale);
  EXPECT_EQ(ekf.state().values(), x);
}

TEST(Ekf, StaleFramesInARowAreOneEvent) {
  const Problem problem = DepthFilter();
  Ekf ekf(problem, {}, StreamsOf(problem));
  const auto stale = [&](double t_s) {
    std::vector<std::string> texts;
    for (const Event& event : ekf.Process(FrameAt(t_s, {{0, 80.0}})).events) {
      if (event.kind == EventKind::kStale) texts.push_back(event.text);
    }
    return texts;
  };
  const std::vector<std::string> none;
  EXPECT_EQ(stale(1.0), none);
  EXPECT_EQ(
      stale(0.5),
      std::vector<std::string>{
          "the frame at 0.500000 s is older than the state at 1.000000 s: the measurements of "
          "this frame are not used; to use late frames, set `out_of_sequence: {policy: "
          "rollback, ...}`, or use alidade::Rollback in C++"});
  EXPECT_EQ(stale(0.6), none);  // this frame belongs to the same episode
  EXPECT_EQ(stale(1.1), none);
  EXPECT_EQ(stale(1.0).size(), 1u);
}

// Tests fault 38 of tests/faults/README.md.
TEST(Ekf, AGapIsSteppedInEqualParts) {
  EkfOptions options;
  options.max_dt_s = 0.3;
  const Problem problem = MovingPoint(2.0);
  Ekf ekf(problem, options, {});
  ekf.Start(0);
  ekf.Process(FrameAt(1.0, {}));
  Textbook textbook;
  for (int i = 0; i < 4; ++i) textbook.Step(0.25, 2.0);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.x"), textbook.p(0, 0), 1e-12);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.v", "p.v"), textbook.p(1, 1), 1e-12);
}

TEST(Ekf, FixedBlocksAreNeitherMovedNorCorrected) {
  Problem problem;
  const SharedMotion model = testing::ConstantVelocityMotion(1.0);
  AddMotion(problem, "p", model, {{"x", 1.0, 2.0}});
  const BlockId v = problem.layout.Declare("p.v", "p", model->blocks()[1], BlockStatus::kConstant);
  problem.motions[0].blocks.push_back(v);
  problem.priors.push_back({v, {2.0}, {}, ""});
  Ekf ekf(problem, {}, {});
  ekf.Start(0);
  ekf.Process(FrameAt(0.5, {}));
  EXPECT_NEAR(ValueOf(ekf.state(), "p.x"), 2.0, 1e-15);
  EXPECT_EQ(ValueOf(ekf.state(), "p.v"), 2.0);
  // The variance is P = 4 + (dt^2/2)^2.
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.x"), 4.0 + std::pow(0.125, 2), 1e-14);
}

/// Measures z = a b.
struct Product : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"b"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0] * b[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
};

// The sensor measures z = x^2 at x = 2, so H = (4, 0) and S = 17. The number of roles equals the
// number of states.
TEST(Ekf, TwoRolesOfOneBlockAddUpInItsColumn) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 2.0, 1.0}});
  AddMotion(problem, "q", testing::ConstantMotion(1), {{"x", 5.0, 1.0}});
  AddSensor(problem, "square", MakeSensor(Product(), "product"), {"p.x", "p.x"});
  for (const Fuse fuse : {Fuse::kJoint, Fuse::kPerMeasurement}) {
    EkfOptions options;
    options.fuse = fuse;
    Ekf ekf(problem, options, StreamsOf(problem));
    ekf.Start(0);
    const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 5.0}}));
    EXPECT_NEAR(report.measurements()[0].s[0], 17.0, 1e-13);
    EXPECT_NEAR(ValueOf(ekf.state(), "p.x"), 2.0 + 4.0 / 17.0, 1e-14);
    EXPECT_EQ(ValueOf(ekf.state(), "q.x"), 5.0);
    EXPECT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.x"), 1.0 / 17.0, 1e-14);
    EXPECT_EQ(CovarianceOf(ekf.state(), "q.x", "q.x"), 1.0);
  }
}

/// Measures z = p - r, the offset of a landmark.
struct OffsetOf : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"position"},
                                     Quantity{"landmark", "", "", "", ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* r, const T* p, T* z) const {
    z[0] = p[0] - r[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
};

// With p ~ N(0, 4), r ~ N(0, 1) and z = 6, S = 6, so p = 4 and r = -1. The blocks and the roles
// have different orders.
TEST(Ekf, ASensorOfLandmarksMayReadBlocksInAnyOrder) {
  Problem problem;
  AddMotion(problem, "map", testing::ConstantMotion(1), {{"p", 0.0, 2.0}});
  AddMotion(problem, "cam", testing::ConstantMotion(1), {{"r", 0.0, 1.0}});
  AddSensor(problem, "offset", MakeSensor(OffsetOf(), "offset"), {"cam.r", "map.p"});
  for (const Fuse fuse : {Fuse::kJoint, Fuse::kPerMeasurement}) {
    EkfOptions options;
    options.fuse = fuse;
    Ekf ekf(problem, options, StreamsOf(problem));
    ekf.Start(0);
    ekf.Process(FrameAt(0.0, {{0, 6.0}}));
    EXPECT_NEAR(ValueOf(ekf.state(), "map.p"), 4.0, 1e-14);
    EXPECT_NEAR(ValueOf(ekf.state(), "cam.r"), -1.0, 1e-14);
  }
}

// P R / (P + R) equals R to 1e-14. The difference P - P^2 / (P + R) is accurate only to the last
// digit of P, which is 1.5 % of R.
TEST(Ekf, AVarianceThatNearlyVanishesKeepsItsDigitsInLargeFilters) {
  for (const int n : {3, 20}) {
    Problem problem;
    constexpr double kP = 0.7, kR = 7e-15;
    for (int i = 0; i < n; ++i) {
      AddMotion(problem, "b" + std::to_string(i), testing::ConstantMotion(1),
                {{"x", 1.0, std::sqrt(kP)}});
    }
    AddSensor(problem, "direct", MakeSensor(Linear(1.0, std::sqrt(kR)), "linear"), {"b0.x"});
    Ekf ekf(problem, {}, StreamsOf(problem));
    EXPECT_EQ(ekf.Process(FrameAt(0.0, {{0, 1.1}})).measurements()[0].outcome, Outcome::kAccepted);
    EXPECT_NEAR(CovarianceOf(ekf.state(), "b0.x", "b0.x") / kR, 1.0, 1e-6) << n;
    EXPECT_NEAR(CovarianceOf(ekf.state(), "b1.x", "b1.x"), kP, 1e-15) << n;
  }
}

}  // namespace
}  // namespace alidade
