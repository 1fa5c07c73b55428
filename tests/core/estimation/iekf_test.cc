// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/iekf.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <functional>

#include "alidade/base/random.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

TEST(Iekf, EqualsTheEkfOnALinearProblem) {
  Problem problem = MovingPoint();
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  AddSensor(problem, "doubled", LinearSensor(2.0, 0.7), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Iekf iekf(problem, {}, StreamsOf(problem));
  Random random(21);
  for (int k = 0; k < 200; ++k) {
    const Frame frame = FrameAt(0.033 * k, {{0, random.Normal()}, {1, random.Normal()}});
    const UpdateReport& plain = ekf.Process(frame);
    const UpdateReport& iterated = iekf.Process(frame);
    ASSERT_TRUE(iterated.events.empty()) << iterated.events[0].text;
    ASSERT_LT((ekf.state().covariance().Dense() - iekf.state().covariance().Dense()).norm(), 1e-9);
    for (const char* block : {"p.x", "p.v"}) {
      ASSERT_NEAR(ValueOf(iekf.state(), block), ValueOf(ekf.state(), block), 1e-9) << k;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      ASSERT_NEAR(iterated.measurements()[i / 2].gain[i % 2],
                  plain.measurements()[i / 2].gain[i % 2], 1e-9);
    }
  }
}

/// Returns the minimiser of `c` in [low, high], found by golden-section search.
double Least(const std::function<double(double)>& c, double low, double high) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  for (int i = 0; i < 200; ++i) {
    const double a = high - ratio * (high - low), b = low + ratio * (high - low);
    (c(a) < c(b) ? high : low) = c(a) < c(b) ? b : a;
  }
  return 0.5 * (low + high);
}

TEST(Iekf, FindsTheMostProbableState) {
  Problem problem = DepthFilter();
  problem.sensors.pop_back();
  Iekf iekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 110.0}}));
  EXPECT_TRUE(report.events.empty());
  const auto cost = [](double z) {
    return std::pow((z - 0.35) / 0.1, 2) + std::pow(110.0 - 26.0 / z, 2);
  };
  const double least = Least(cost, 0.15, 0.4);
  // The tolerance is a ten-thousandth of the posterior sigma, which is 2 mm.
  EXPECT_NEAR(ValueOf(iekf.state(), "target.depth"), least, 2e-7);
  // P = (1 / P0 + H' H)^-1 at the estimate. If the estimate moves by the tolerance, H changes P by
  // 3e-6 of its value.
  const double h = -26.0 / (least * least);
  const double p = 1.0 / (1.0 / 0.01 + h * h);
  EXPECT_NEAR(CovarianceOf(iekf.state(), "target.depth", "target.depth") / p, 1.0, 1e-4);
  // The report contains the values at the prediction, not at the estimate.
  EXPECT_NEAR(report.measurements()[0].h[0], 26.0 / 0.35, 1e-12);
  EXPECT_NEAR(report.measurements()[0].innovation[0], 110.0 - 26.0 / 0.35, 1e-12);
  EXPECT_NEAR(report.measurements()[0].s[0], std::pow(26.0 / 0.35 / 0.35, 2) * 0.01 + 1.0, 1e-9);
}

TEST(Iekf, TheGateIsThatOfThePrediction) {
  const Problem problem = DepthFilter();
  IekfOptions options;
  options.gate = 0.999;
  Iekf iekf(problem, options, StreamsOf(problem));
  Ekf ekf(problem, options, StreamsOf(problem));
  const std::vector<double> x = iekf.state().values();
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 300.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kGated);
  EXPECT_EQ(report.measurements()[0].nis,
            ekf.Process(FrameAt(0.0, {{0, 300.0}})).measurements()[0].nis);
  EXPECT_EQ(iekf.state().values(), x);
}

/// Measures z = atan(x).
struct ArcTangent : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    using std::atan;
    z[0] = atan(x[0]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(1e-3);
  }
};

/// An ArcTangent with the analytic derivative 1 / (1 + x^2). `count` counts the calls of the
/// derivative.
struct CountedArcTangent : ArcTangent {
  int* count;
  CountedArcTangent(const ArcTangent& base, int* counter) : ArcTangent(base), count(counter) {}
  void Jacobian(const double* x, MatrixRef j) const {
    ++*count;
    j(0, 0) = 1.0 / (1.0 + x[0] * x[0]);
  }
};

/// Measures z = x^2. The Jacobian is defined only for |x| > 2.
struct Creased : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0] * x[0];
    return true;
  }
  void Jacobian(const double* x, MatrixRef j) const {
    j(0, 0) = std::abs(x[0]) > 2.0 ? 2.0 * x[0] : std::nan("");
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(1.0);
  }
};

Problem FarArcTangent() {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 3.0, 100.0}});
  AddSensor(problem, "s", MakeSensor(ArcTangent(), "arc_tangent"), {"p.x"});
  return problem;
}

// Tests fault 81 of tests/faults/README.md: the filter uses the iterate with the lowest cost.
TEST(Iekf, HalvesAStepThatWouldRaiseTheCost) {
  // A full Gauss-Newton step from 3 leads to -9.5, the next step leads to 116, and so on.
  const Problem problem = FarArcTangent();
  Iekf iekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 0.0}}));
  EXPECT_TRUE(report.events.empty()) << report.events[0].text;
  EXPECT_NEAR(ValueOf(iekf.state(), "p.x"), 0.0, 1e-6);
}

// Tests fault 81 of tests/faults/README.md.
TEST(Iekf, AnUpdateThatDoesNotConvergeKeepsTheLastIterateAndSaysSo) {
  const Problem problem = FarArcTangent();
  IekfOptions options;
  options.max_iterations = 2;
  Iekf iekf(problem, options, StreamsOf(problem));
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 0.0}}));
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kNotConverged);
  EXPECT_NE(report.events[0].text.find("stopped after 2 iterations"), std::string::npos);
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
  EXPECT_LT(std::abs(ValueOf(iekf.state(), "p.x")), 3.0);
  EXPECT_FALSE(iekf.diverged());
}

// The last H was evaluated at the last iterate x, so P = (1 / P0 + H^2 / R)^-1. The remaining step
// is (P0 H (r + H dx) / S - dx) / sqrt(P), which is computed here by hand.
TEST(Iekf, WhatIsSaidOfAnUpdateThatDoesNotConvergeIsTrueOfItsLastIterate) {
  const Problem problem = FarArcTangent();
  for (const int most : {2, 3}) {
    IekfOptions options;
    options.max_iterations = most;
    Iekf iekf(problem, options, StreamsOf(problem));
    const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 0.0}}));
    ASSERT_EQ(report.events.size(), 1u) << most;
    int count = 0;
    double left = 0.0;
    ASSERT_EQ(std::sscanf(report.events[0].text.c_str(),
                          "an update stopped after %d iterations: the next step would be %lf sigma",
                          &count, &left),
              2)
        << report.events[0].text;
    EXPECT_EQ(count, most);
    const double x = ValueOf(iekf.state(), "p.x"), dx = x - 3.0;
    const double h = 1.0 / (1.0 + x * x), p0 = 1e4, r = 1e-6, innovation = -std::atan(x);
    const double step = p0 * h * (innovation + h * dx) / (h * p0 * h + r) - dx;
    const double p = 1.0 / (1.0 / p0 + h * h / r);
    EXPECT_NEAR(CovarianceOf(iekf.state(), "p.x", "p.x") / p, 1.0, 2.2e-16 * p0 / p) << most;
    EXPECT_NEAR(left / (std::abs(step) / std::sqrt(p)), 1.0, 5e-3)
        << most;  // The text of the event has three digits.
  }
}

TEST(Iekf, LinearisesAnUpdateNoMoreOftenThanItMay) {
  for (const int most : {2, 3}) {
    int linearisations = 0;
    Problem problem;
    AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 3.0, 100.0}});
    AddSensor(problem, "s", MakeSensor(CountedArcTangent{{}, &linearisations}, "counted"), {"p.x"});
    IekfOptions options;
    options.max_iterations = most;
    Iekf(problem, options, StreamsOf(problem)).Process(FrameAt(0.0, {{0, 0.0}}));
    EXPECT_EQ(linearisations, most);
  }
}

// The first step leads from 2.5 to 1.34. At 1.34, h is defined, but the derivative of h is not.
TEST(Iekf, AnIterateThatCannotBeLinearisedIsTheLast) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 2.5, 1.0}});
  AddSensor(problem, "plain", LinearSensor(1.0, 1.0), {"p.x"});
  AddSensor(problem, "creased", MakeSensor(Creased{}, "creased"), {"p.x"});
  Iekf iekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 2.5}, {1, 0.0}}));
  for (const MeasurementReport& entry : report.measurements()) {
    EXPECT_EQ(entry.outcome, Outcome::kAccepted);
  }
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kNotConverged);
  EXPECT_EQ(report.events[0].text,
            "an update stopped after 1 iterations because h has no Jacobian; the last iterate is "
            "used");
  // At the prediction H = 5, so 1 / P = 1 + 1 + 25. The step is P 5 (0 - 2.5^2).
  EXPECT_NEAR(CovarianceOf(iekf.state(), "p.x", "p.x"), 1.0 / 27.0, 1e-12);
  EXPECT_NEAR(ValueOf(iekf.state(), "p.x"), 2.5 - 5.0 * 6.25 / 27.0, 1e-12);
}

TEST(Iekf, WithoutNoiseTheUpdateIsThatOfTheEkf) {
  Problem problem = MovingPoint();
  AddSensor(problem, "direct", LinearSensor(1.0, 1e-200), {"p.x"});
  Iekf iekf(problem, {}, StreamsOf(problem));
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{0, 3.0}}));
  ekf.Process(FrameAt(0.0, {{0, 3.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
  EXPECT_EQ(iekf.state().values(), ekf.state().values());
}

struct Still : Motion<0, UnitQuaternion, UnitVector> {
  static constexpr std::array kBlocks{Quantity{"q"}, Quantity{"u"}};
  template <class T>
  void Step(const T* q, const T* u, const T*, double, T* next_q, T* next_u) const {
    for (int i = 0; i < 4; ++i) next_q[i] = q[i];
    for (int i = 0; i < 3; ++i) next_u[i] = u[i];
  }
  void SqrtQ(double, MatrixRef) const {}
  bool Stationary() const { return true; }
};

/// Measures z = R(q) u.
struct Turned : Sensor<Vec<3>, UnitQuaternion, UnitVector> {
  static constexpr std::array kRoles{Quantity{"q"}, Quantity{"u"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* q, const T* u, T* z) const {
    const T pure[4] = {T(0.0), u[0], u[1], u[2]}, back[4] = {q[0], -q[1], -q[2], -q[3]};
    T half[4], turned[4];
    UnitQuaternion::Multiply(q, pure, half);
    UnitQuaternion::Multiply(half, back, turned);
    for (int i = 0; i < 3; ++i) z[i] = turned[i + 1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.1);
  }
};

Problem TurnedVector() {
  Problem problem;
  MotionBinding binding{"s", MakeMotion(Still(), "still"), {}};
  const std::vector<double> means[2] = {{1.0, 0.0, 0.0, 0.0}, {0.6, 0.0, 0.8}};
  for (std::size_t i = 0; i < 2; ++i) {
    const Space& space = binding.model->blocks()[i];
    const BlockId id = problem.layout.Declare("s." + space.name, "s", space);
    binding.blocks.push_back(id);
    Prior prior;
    prior.block = id;
    prior.mean = means[i];
    const int n = space.geometry.tangent;
    prior.covariance = 0.5 * Eigen::MatrixXd::Identity(n, n);
    problem.priors.push_back(prior);
  }
  problem.motions.push_back(binding);
  AddSensor(problem, "turned", MakeSensor(Turned(), "turned"), {"s.q", "s.u"});
  return problem;
}

TEST(Iekf, FindsTheMostProbableRotationAndDirection) {
  const Problem problem = TurnedVector();
  IekfOptions options;
  options.max_iterations = 100;
  options.tolerance = 1e-8;
  Iekf iekf(problem, options, StreamsOf(problem));
  Frame frame;
  frame.timestamp = 0;
  const double z[3] = {-0.3, 0.9, 0.2};
  frame.measurements.push_back({0, 0, -1, {z[0], z[1], z[2]}, {}});
  EXPECT_TRUE(iekf.Process(frame).events.empty());
  // At the estimate, the gradient of the cost with respect to the tangent at the prior must be
  // zero.
  const Geometry geometries[2] = {Geometry::UnitQuaternion(), Geometry::UnitVector()};
  double d[5];
  geometries[0].Minus(iekf.state().value(0), problem.priors[0].mean.data(), d);
  geometries[1].Minus(iekf.state().value(1), problem.priors[1].mean.data(), d + 3);
  const auto cost = [&] {
    double q[4], u[3], h[3], sum = 0.0;
    geometries[0].Plus(problem.priors[0].mean.data(), d, q);
    geometries[1].Plus(problem.priors[1].mean.data(), d + 3, u);
    Turned().Predict(q, u, h);
    for (int i = 0; i < 3; ++i) sum += std::pow((z[i] - h[i]) / 0.1, 2);
    for (const double element : d) sum += element * element / 0.5;
    return sum;
  };
  EXPECT_GT(std::hypot(d[0], d[1], d[2]), 0.5);  // large enough for the curvature to have an effect
  constexpr double kStep = 1e-5;
  for (double& element : d) {
    const double middle = element;
    element = middle + kStep;
    const double above = cost();
    element = middle - kStep;
    const double below = cost();
    element = middle;
    // The second derivatives are about 2 / 0.1^2 = 200, so the tolerance is equivalent to a
    // distance of 1e-7 from the optimum.
    EXPECT_NEAR((above - below) / (2.0 * kStep), 0.0, 2e-5);
  }
}

TEST(Ekf, ACovarianceMovesWithItsUnitVectorTheSameInSmallAndLargeFilters) {
  const Problem few = TurnedVector();
  Problem many = TurnedVector();
  for (int i = 0; i < 20; ++i) {
    AddMotion(many, "m" + std::to_string(i), testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  }
  Ekf small(few, {}, StreamsOf(few)), large(many, {}, StreamsOf(many));
  Frame frame;
  frame.timestamp = 0;
  frame.measurements.push_back({0, 0, -1, {-0.3, 0.9, 0.2}, {}});
  small.Process(frame);
  large.Process(frame);
  EXPECT_LT(
      (small.state().covariance().Dense() - large.state().covariance().Dense().topLeftCorner(5, 5))
          .norm(),
      1e-12);
}

/// Measures z = x^k c + n.
struct PowerTimes : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"c"}};
  static constexpr Quantity kMeasurement{"z"};
  int power;
  explicit PowerTimes(int k) : power(k) {}
  template <class T>
  bool Predict(const T* x, const T* c, T* z) const {
    z[0] = c[0];
    for (int i = 0; i < power; ++i) z[0] = z[0] * x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.1);
  }
};

/// Measures z = x - c + n. The update changes P = 1.9 I to P = [[1, .9], [.9, 1]], because 1.9^2 /
/// S = .9.
struct Difference : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"c"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, const T* c, T* z) const {
    z[0] = x[0] - c[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(std::sqrt(1.9 * 1.9 / 0.9 - 3.8));
  }
};

/// Returns the state after the measurement z = 2 = x^k c with R = .01. The sensor treats c as
/// known. Before this measurement x = c = 1, and an update with Difference has correlated x and c.
State AfterAHeldRole(int power) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 1.0, std::sqrt(1.9)}});
  AddMotion(problem, "q", testing::ConstantMotion(1), {{"c", 1.0, std::sqrt(1.9)}});
  AddSensor(problem, "difference", MakeSensor(Difference(), "difference"), {"p.x", "q.c"});
  AddSensor(problem, "power", MakeSensor(PowerTimes(power), "power"), {"p.x", "q.c"});
  problem.sensors[1].roles[1].mode = RoleMode::kKnown;
  IekfOptions options;
  options.max_iterations = 50;
  options.tolerance = 1e-9;
  Iekf iekf(problem, options, StreamsOf(problem));
  iekf.Process(FrameAt(0.0, {{0, 0.0}}));
  EXPECT_NEAR(CovarianceOf(iekf.state(), "p.x", "q.c"), 0.9, 1e-12);
  EXPECT_NEAR(CovarianceOf(iekf.state(), "p.x", "p.x"), 1.0, 1e-12);
  const UpdateReport& report = iekf.Process(FrameAt(0.0, {{1, 2.0}}));
  EXPECT_TRUE(report.events.empty()) << report.events[0].text;
  return iekf.state();
}

// c is treated as known, so h = x is linear: K = (1, .9) / 1.01.
TEST(Iekf, HoldsARoleInEveryIteration) {
  const State linear = AfterAHeldRole(1);
  EXPECT_NEAR(ValueOf(linear, "p.x"), 1.0 + 1.0 / 1.01, 1e-9);
  EXPECT_NEAR(ValueOf(linear, "q.c"), 1.0 + 0.9 / 1.01, 1e-9);
  EXPECT_NEAR(CovarianceOf(linear, "p.x", "p.x"), 0.01 / 1.01, 1e-9);
  EXPECT_NEAR(CovarianceOf(linear, "q.c", "q.c"), 1.0 - 0.81 / 1.01, 1e-9);
  const State cubic = AfterAHeldRole(3);
  const auto cost = [](double x) {
    return std::pow(x - 1.0, 2) + std::pow((2.0 - x * x * x) / 0.1, 2);
  };
  const double x = Least(cost, 1.0, 1.5);
  EXPECT_NEAR(ValueOf(cubic, "p.x"), x,
              1e-7);  // Golden-section search is accurate to the square root of eps.
  EXPECT_NEAR(ValueOf(cubic, "q.c"), 1.0 + 0.9 * (x - 1.0), 1e-7);
}

TEST(Iekf, RefusesWhatItCannotDo) {
  Problem considered = DepthFilter();
  considered.sensors[1].roles[1].mode = RoleMode::kConsider;
  EXPECT_THROW(Iekf(considered, {}, StreamsOf(considered)), Error);
  Problem measured = DepthFilter();
  measured.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  EXPECT_THROW(Iekf(measured, {}, StreamsOf(measured)), Error);
  IekfOptions first;
  first.jacobian = JacobianPolicy::kFirstEstimate;
  EXPECT_THROW(Iekf(DepthFilter(), first, {}), Error);
  IekfOptions once;
  once.max_iterations = 1;
  EXPECT_THROW(Iekf(DepthFilter(), once, {}), Error);
}

}  // namespace
}  // namespace alidade
