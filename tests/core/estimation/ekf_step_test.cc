// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr double kPi = 3.14159265358979323846;

/// Returns the variance of the velocity after a gap of `gap` ns that is divided into steps of at
/// most `max_dt_s`. The acceleration is constant within each step, so n steps add gap^2 / n to the
/// prior variance of 9.
double VelocityVarianceAfter(Timestamp gap, double max_dt_s) {
  EkfOptions options;
  options.max_dt_s = max_dt_s;
  Ekf ekf(MovingPoint(1.0), options, {});
  ekf.Start(0);
  Frame frame;
  frame.timestamp = gap;
  ekf.Process(frame);
  EXPECT_EQ(ekf.timestamp(), gap);
  return CovarianceOf(ekf.state(), "p.v", "p.v");
}

TEST(EkfStep, AGapOfTheLongestStepIsOnePart) {
  // Because of rounding, 3e7 * 1e-9 is above 0.03.
  EXPECT_NEAR(VelocityVarianceAfter(30'000'000, 0.03) - 9.0, 9e-4, 1e-13);
  EXPECT_NEAR(VelocityVarianceAfter(90'000'000, 0.03) - 9.0, 81e-4 / 3.0, 1e-13);
  EXPECT_NEAR(VelocityVarianceAfter(30'000'001, 0.03) - 9.0, 9e-4 / 2.0, 1e-9);
}

TEST(EkfStep, TheLongestStepMayBeOfAnySize) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double longest : {infinity, 1e300, 1e10, 9.3e9}) {
    EXPECT_NEAR(VelocityVarianceAfter(2'000'000'000, longest), 9.0 + 4.0, 1e-12) << longest;
  }
  // Timestamps are whole nanoseconds, so the length of a step is a whole number of nanoseconds.
  EXPECT_NEAR(VelocityVarianceAfter(4, 1e-12) - 9.0, 0.0, 1e-12);
}

/// Motion model x' = 1e10 x + w.
struct Stretching : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = 1e10 * x[0] + w[0];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TEST(EkfStep, ACovarianceThatOverflowsLeavesStateAndCovarianceAsTheyWere) {
  // F P F' = 1e20 * 1e300 overflows. The step of the other point is valid.
  Problem problem = MovingPoint();
  AddMotion(problem, "q", MakeMotion(Stretching(), "stretching"), {{"x", 1.0, 1e150}});
  Ekf ekf(problem, {}, {});
  ekf.Start(0);
  const std::vector<double> x = ekf.state().values();
  const Eigen::MatrixXd p = ekf.state().covariance().Dense();
  const UpdateReport& report = ekf.Process(FrameAt(1.0, {}));
  EXPECT_TRUE(ekf.failed());
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kNotFinite);
  EXPECT_EQ(ekf.state().values(), x);
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
}

TEST(EkfStep, ACovarianceCloseToTheLargestNumberStillSteps) {
  // 1e20 * 1e287 is finite. The bound that decides whether a backup copy is needed overflows.
  Problem problem;
  AddMotion(problem, "q", MakeMotion(Stretching(), "stretching"), {{"x", 1.0, std::sqrt(1e287)}});
  Ekf ekf(problem, {}, {});
  ekf.Start(0);
  ekf.Process(FrameAt(1.0, {}));
  EXPECT_FALSE(ekf.failed());
  EXPECT_NEAR(CovarianceOf(ekf.state(), "q.x", "q.x") / 1e307, 1.0, 1e-12);
}

/// Motion model of an angle that grows by 1 rad in each step, and of a quaternion that rotates
/// about z. The norm of the quaternion grows by 0.1 % in each step.
struct TurningBlocks : Motion<0, Angle, UnitQuaternion> {
  static constexpr std::array kBlocks{Quantity{"a", "rad"}, Quantity{"q"}};
  template <class T>
  void Step(const T* a, const T* q, const T*, double, T* next_a, T* next_q) const {
    next_a[0] = a[0] + 1.0;
    const double turn[4] = {1.001 * std::cos(0.1), 0.0, 0.0, 1.001 * std::sin(0.1)};
    UnitQuaternion::Multiply(q, turn, next_q);
  }
  void SqrtQ(double, MatrixRef) const {}
};

/// Measures z = a + pi. z determines a.
struct Opposite : Sensor<Angle, Angle> {
  static constexpr std::array kRoles{Quantity{"a", "rad"}};
  static constexpr Quantity kMeasurement{"z", "rad"};
  static constexpr int kInitialises = 0;
  template <class T>
  bool Predict(const T* a, T* z) const {
    z[0] = Angle::Wrap(T(a[0] + kPi));
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
  template <class T>
  bool Initialise(const T* z, T* a) const {
    a[0] = z[0] - kPi;
    return true;
  }
};

Problem Turn() {
  Problem problem;
  MotionBinding binding{"t", MakeMotion(TurningBlocks(), "turning"), {}};
  for (std::size_t i = 0; i < 2; ++i) {
    const Space& space = binding.model->blocks()[i];
    const BlockId id = problem.layout.Declare("t." + space.name, "t", space);
    binding.blocks.push_back(id);
    const int n = space.geometry.tangent;
    Prior prior;
    prior.block = id;
    prior.mean = i == 0 ? std::vector<double>{0.0} : std::vector<double>{1.0, 0.0, 0.0, 0.0};
    prior.covariance = Eigen::MatrixXd::Identity(n, n);
    problem.priors.push_back(prior);
  }
  problem.motions.push_back(binding);
  return problem;
}

TEST(EkfStep, BlocksStayOnTheirManifold) {
  const Problem problem = Turn();
  Ekf ekf(problem, {}, {});
  ekf.Start(0);
  for (int k = 1; k <= 10; ++k) {
    ekf.Process(FrameAt(k, {}));
    EXPECT_NEAR(ValueOf(ekf.state(), "t.a"), std::remainder(k, 2.0 * kPi), 1e-12) << k;
    const double* q = ekf.state().value(1);
    EXPECT_NEAR(std::hypot(q[0], q[3]), 1.0, 1e-15) << k;
    EXPECT_NEAR(std::atan2(q[3], q[0]), 0.1 * k, 1e-12) << k;
  }
}

TEST(EkfStep, ABlockThatStartsFromAMeasurementIsOnItsManifold) {
  Problem problem = Turn();
  AddSensor(problem, "opposite", MakeSensor(Opposite(), "opposite"), {"t.a"});
  problem.priors[0] = {0, {}, {}, "opposite"};
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Process(FrameAt(0.0, {{0, -1.0}}));
  EXPECT_NEAR(ValueOf(ekf.state(), "t.a"), kPi - 1.0, 1e-12);
}

/// Measures z = a + 6 rad without wrapping.
struct Unwrapped : Opposite {
  template <class T>
  bool Predict(const T* a, T* z) const {
    z[0] = a[0] + 6.0;
    return true;
  }
};

// Tests fault 84 of tests/faults/README.md.
TEST(EkfStep, APredictedAngleIsBroughtIntoItsInterval) {
  Problem problem = Turn();
  AddSensor(problem, "unwrapped", MakeSensor(Unwrapped(), "unwrapped"), {"t.a"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Ukf ukf(problem, {}, StreamsOf(problem));
  for (Estimator* const one : {static_cast<Estimator*>(&ekf), static_cast<Estimator*>(&ukf)}) {
    const UpdateReport& report = one->Process(FrameAt(0.0, {{0, -0.4}}));
    const MeasurementReport& entry = report.measurements().front();
    EXPECT_NEAR(entry.h[0], 6.0 - 2.0 * kPi, 1e-12);
    EXPECT_NEAR(entry.innovation[0], -0.4 - (6.0 - 2.0 * kPi), 1e-12);
  }
}

// Tests fault 84 of tests/faults/README.md: 3 and -3 rad are 0.28 rad apart, and the update uses
// the shorter direction.
TEST(EkfStep, AnInnovationOfAnAngleTakesTheShortWay) {
  Problem problem = Turn();
  AddSensor(problem, "opposite", MakeSensor(Opposite(), "opposite"), {"t.a"});
  problem.priors[0].mean = {3.0 - kPi};  // h = 3 rad
  for (const double turns : {0.0, 1.0, -2.0}) {
    Ekf ekf(problem, {}, StreamsOf(problem));
    Ukf ukf(problem, {}, StreamsOf(problem));
    for (Estimator* const one : {static_cast<Estimator*>(&ekf), static_cast<Estimator*>(&ukf)}) {
      const UpdateReport& report = one->Process(FrameAt(0.0, {{0, -3.0 + 2.0 * kPi * turns}}));
      const MeasurementReport& entry = report.measurements().front();
      EXPECT_EQ(entry.outcome, Outcome::kAccepted);
      const double short_way = 2.0 * kPi - 6.0;
      EXPECT_NEAR(entry.innovation[0], short_way, 1e-12);
      // The variances are P = 1 and R = 0.01.
      EXPECT_NEAR(ValueOf(one->state(), "t.a"), 3.0 - kPi + short_way / 1.01, 1e-9);
    }
  }
}

// The event is reported for the first gap that takes several steps. Afterwards it is reported only
// for a gap that takes at least twice as many steps as the last reported gap.
TEST(Ekf, AGapInPartsIsNotedWhereItTakesTwiceAsManyAsBefore) {
  EkfOptions options;
  options.max_dt_s = 0.1;
  Ekf ekf(MovingPoint(), options, {});
  ekf.Start(0);
  double t_s = 0.0;
  const auto noted = [&](double gap_s) {
    t_s += gap_s;
    return HasEvent(ekf.Process(FrameAt(t_s, {})), EventKind::kSubsteps);
  };
  EXPECT_FALSE(noted(0.1));
  EXPECT_TRUE(noted(0.2));
  EXPECT_FALSE(noted(0.3));
  EXPECT_TRUE(noted(0.4));
  EXPECT_FALSE(noted(0.4));
}

}  // namespace
}  // namespace alidade
