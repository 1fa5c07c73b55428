// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/robust_loss.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr RobustLoss kHuber{LossKind::kHuber, 1.345}, kCauchy{LossKind::kCauchy, 2.0};

TEST(RobustLoss, TheWeightIsTheSlopeOfRhoOverD) {
  constexpr double kStep = 1e-6;
  for (const RobustLoss& loss : {RobustLoss{}, kHuber, kCauchy}) {
    for (const double d : {0.1, 1.0, 1.3, 1.4, 2.0, 7.0, 100.0}) {
      const double slope = (Rho(loss, d + kStep) - Rho(loss, d - kStep)) / (2.0 * kStep);
      EXPECT_NEAR(Weight(loss, d), slope / d, 1e-8) << ToString(loss.kind) << ' ' << d;
    }
    EXPECT_EQ(Weight(loss, 0.0), 1.0);
    EXPECT_EQ(Rho(loss, 0.0), 0.0);
  }
}

TEST(RobustLoss, HasTheTextbookValues) {
  // rho is k d - k^2 / 2 for Huber, and k^2 / 2 log(1 + d^2 / k^2) for Cauchy.
  EXPECT_NEAR(Rho(kHuber, 3.0), 1.345 * 3.0 - 0.5 * 1.345 * 1.345, 1e-15);
  EXPECT_NEAR(Rho(kCauchy, 4.0), 2.0 * std::log(5.0), 1e-15);
  EXPECT_NEAR(Weight(kHuber, 2.69), 0.5, 1e-15);
  EXPECT_NEAR(Weight(kCauchy, 2.0), 0.5, 1e-15);
  EXPECT_EQ(Weight(kHuber, 1.345), 1.0);
}

/// Returns a problem with x ~ N(0, 4), measured with R = 1 and the given loss.
Problem Measured(const RobustLoss& loss) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 2.0}});
  AddSensor(problem, "direct", LinearSensor(1.0, 1.0), {"p.x"});
  problem.sensors[0].loss = loss;
  return problem;
}

/// Processes one measurement z of the problem Measured(loss). Stores the resulting state.
template <class Filter>
UpdateReport Measure(const RobustLoss& loss, double z, State& state) {
  const Problem problem = Measured(loss);
  Filter filter(problem, {}, StreamsOf(problem));
  const UpdateReport report = filter.Process(FrameAt(0.0, {{0, z}}));
  state = filter.state();
  return report;
}

template <class Filter>
class RobustFilter : public ::testing::Test {};
using Filters = ::testing::Types<Ekf, Iekf, SquareRootEkf, Ukf, RtsSmoother>;
TYPED_TEST_SUITE(RobustFilter, Filters);

TYPED_TEST(RobustFilter, TakesAnOutlierWithROverW) {
  // S = 5, so d = 10 / sqrt(5).
  constexpr double kOutlier = 10.0;
  const double d = kOutlier / std::sqrt(5.0);
  for (const auto& [loss, w] :
       {std::pair{kHuber, 1.345 / d}, {kCauchy, 1.0 / (1.0 + d * d / 4.0)}}) {
    State state;
    const UpdateReport report = Measure<TypeParam>(loss, kOutlier, state);
    const double gain = 4.0 / (4.0 + 1.0 / w);
    EXPECT_NEAR(ValueOf(state, "p.x"), gain * kOutlier, 1e-12);
    EXPECT_NEAR(CovarianceOf(state, "p.x", "p.x"), 4.0 * (1.0 - gain), 1e-12);
    EXPECT_NEAR(report.measurements()[0].nis, d * d, 1e-12);
    EXPECT_NEAR(report.measurements()[0].s[0], 4.0 + 1.0 / w, 1e-12);
  }
}

// If R / w overflows, the measurement is not used. The valid measurement in the same frame is still
// used.
TYPED_TEST(RobustFilter, LeavesOutWhatItsWeightOfZeroIsFor) {
  for (const RobustLoss& loss : {kCauchy, kHuber}) {
    Problem problem = Measured({});
    AddSensor(problem, "far", LinearSensor(1.0, 1.0), {"p.x"});
    problem.sensors[1].loss = loss;
    for (const double far : {1e155, 1e200}) {
      TypeParam filter(problem, {}, StreamsOf(problem));
      const UpdateReport& report = filter.Process(FrameAt(0.0, {{0, 2.0}, {1, far}}));
      EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted) << far;
      EXPECT_EQ(report.measurements()[1].outcome, Outcome::kGated) << far;
      EXPECT_NEAR(ValueOf(filter.state(), "p.x"), 1.6, 1e-12) << far;
      EXPECT_NEAR(CovarianceOf(filter.state(), "p.x", "p.x"), 0.8, 1e-12) << far;
    }
    TypeParam filter(problem, {}, StreamsOf(problem));  // here w and R / w are finite
    const UpdateReport& report = filter.Process(FrameAt(0.0, {{0, 2.0}, {1, 1e150}}));
    EXPECT_EQ(report.measurements()[1].outcome, Outcome::kAccepted);
    const double pull = loss.kind == LossKind::kHuber ? 0.8 * 1.345 * std::sqrt(5.0) : 0.0;
    EXPECT_NEAR(ValueOf(filter.state(), "p.x"), 1.6 + pull, 1e-9);
  }
}

/// Measures both elements: z = x + n.
struct PairOfElements : Sensor<Vec<2>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    std::copy_n(x, 2, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(1.0);
  }
};

template <class Filter>
struct OptionsOf : EkfOptions {};
template <>
struct OptionsOf<Iekf> : IekfOptions {};
template <>
struct OptionsOf<Ukf> : UkfOptions {};
EkfOptions& Common(EkfOptions& options) { return options; }
EkfOptions& Common(UkfOptions& options) { return options.filter; }

struct Normal {
  Eigen::Vector2d x;
  Eigen::Matrix2d p;
  /// Kalman update with the noise R / w(d), d^2 = r' S^-1 r.
  void Take(const Eigen::Vector2d& z, const Eigen::Matrix2d& r, const RobustLoss& loss) {
    const Eigen::Vector2d innovation = z - x;
    const double d = std::sqrt(innovation.dot((p + r).inverse() * innovation));
    const Eigen::Matrix2d gain = p * (p + r / Weight(loss, d)).inverse();
    x += gain * innovation;
    p -= gain * p;
  }
};

// Both elements have the same weight. R is correlated and is supplied with the measurement. With
// per-sensor and per-measurement updates, the d of the second measurement is computed after the
// first update. A gate uses S without the loss.
TYPED_TEST(RobustFilter, WeighsAMeasurementOfTwoElementsAsAWhole) {
  Problem problem;
  const SharedMotion still = testing::ConstantMotion(2);
  const BlockId id = problem.layout.Declare("p.x", "p", still->blocks()[0]);
  problem.motions.push_back({"p", still, {id}});
  const Eigen::Matrix2d p0 = (Eigen::Matrix2d() << 4.0, 1.0, 1.0, 2.0).finished();
  problem.priors.push_back({id, {0.0, 0.0}, p0, ""});
  for (const char* name : {"one", "two"}) {
    AddSensor(problem, name, MakeSensor(PairOfElements{}, "pair"), {"p.x"});
    problem.sensors.back().loss = kCauchy;
  }
  const Eigen::Matrix2d r = (Eigen::Matrix2d() << 0.25, 0.15, 0.15, 0.16).finished();
  const Eigen::Vector2d z[] = {{7.0, -4.0}, {1.0, 0.5}};
  Frame frame = FrameAt(0.0, {});
  for (int i = 0; i < 2; ++i) {
    frame.measurements.push_back({frame.timestamp, i, -1, {z[i](0), z[i](1)}, {}});
    frame.measurements.back().covariance = {r(0, 0), r(0, 1), r(1, 0), r(1, 1)};
  }
  Normal expected{Eigen::Vector2d::Zero(), p0};
  for (const Eigen::Vector2d& one : z) expected.Take(one, r, kCauchy);
  OptionsOf<TypeParam> options;
  Common(options).fuse = Fuse::kPerSensor;
  TypeParam filter(problem, options, StreamsOf(problem));
  const UpdateReport report = filter.Process(frame);
  EXPECT_GT(report.measurements()[0].nis, 20.0);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(filter.state().value(id)[i], expected.x(i), 1e-9);
    for (int j = 0; j < 2; ++j) {
      EXPECT_NEAR(filter.state().covariance().Dense()(i, j), expected.p(i, j), 1e-9);
    }
  }
  Common(options).gate = 0.9999;  // chi2(0.9999, 2) = 18.4
  TypeParam gated(problem, options, StreamsOf(problem));
  const UpdateReport& gates = gated.Process(frame);
  EXPECT_EQ(gates.measurements()[0].outcome, Outcome::kGated);
  EXPECT_EQ(gates.measurements()[1].outcome, Outcome::kAccepted);
}

TEST(RobustLoss, HuberLeavesAnInlierAsItIs) {
  State robust, plain;
  Measure<Ekf>(kHuber, 2.0, robust);
  Measure<Ekf>({}, 2.0, plain);
  EXPECT_EQ(robust.values(), plain.values());
  EXPECT_EQ(robust.covariance().Dense(), plain.covariance().Dense());
}

// x is constant, so every smoothed estimate uses all measurements, with 1 / P = 1/4 + w + 1.
TEST(RobustLoss, TheSmootherGoesBackWithROverW) {
  const Problem problem = Measured(kHuber);
  RtsSmoother rts(problem, {}, StreamsOf(problem));
  const double w = 1.345 / (10.0 / std::sqrt(5.0)), first = w * 10.0 / (0.25 + w);
  const double second = first + 0.1;  // the second measurement is an inlier
  rts.Process(FrameAt(0.0, {{0, 10.0}}));
  rts.Process(FrameAt(0.1, {{0, second}}));
  int count = 0;
  rts.Smooth([&](std::size_t, const State& state, const UpdateReport&) {
    ++count;
    const double information = 0.25 + w + 1.0;
    EXPECT_NEAR(ValueOf(state, "p.x"), (w * 10.0 + second) / information, 1e-12);
    EXPECT_NEAR(CovarianceOf(state, "p.x", "p.x"), 1.0 / information, 1e-12);
  });
  EXPECT_EQ(count, 2);
}

// Compares with central differences of step 1e-5. The differences have errors of 1e-10 f''', plus a
// rounding error of 1e-11. None of the losses has a kink at these points.
TEST(EveryLoss, HasTheWeightAndTheCurvatureOfItsRho) {
  constexpr double kStep = 1e-5, kTolerance = 1e-8;
  for (std::size_t kind = 0; kind < kLosses.size(); ++kind) {
    const RobustLoss loss{static_cast<LossKind>(kind), 1.7};
    const LossFunctions& functions = kLosses[kind];
    EXPECT_EQ(Rho(loss, 0.0), 0.0) << functions.name;
    EXPECT_NEAR(Weight(loss, 1e-9), 1.0, kTolerance) << functions.name;
    for (const double d : {0.1, 0.9, 1.6, 1.8, 2.5, 10.0}) {
      const double slope = (Rho(loss, d + kStep) - Rho(loss, d - kStep)) / (2.0 * kStep);
      EXPECT_NEAR(Weight(loss, d), slope / d, kTolerance) << functions.name << ", d = " << d;
      const double turn = (Weight(loss, d + kStep) - Weight(loss, d - kStep)) / (2.0 * kStep);
      EXPECT_NEAR(functions.curvature(d, loss.scale), turn / (2.0 * d), kTolerance)
          << functions.name << ", d = " << d;
    }
  }
}

}  // namespace
}  // namespace alidade
