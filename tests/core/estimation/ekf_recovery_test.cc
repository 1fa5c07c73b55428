// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <type_traits>
#include <vector>

#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "sensors/pose.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Returns the problem with the depth 3 m and the sigma 1 mm. The disparity 65, which means 0.4 m,
/// is far outside the gate.
Problem WithWrongDepth(Problem problem) {
  problem.priors[0].mean = {3.0};
  problem.priors[0].covariance(0, 0) = 1e-6;
  return problem;
}

/// Returns a constant p.x = 0, whose sigma is 0.01, and a sensor that measures it with sigma 0.01.
Problem KnownConstant() {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 0.01}});
  AddSensor(problem, "z", LinearSensor(1.0, 0.01), {"p.x"});
  return problem;
}

// Tests fault 76 of tests/faults/README.md.
TEST(Ekf, AnUpdateThatIsNotFiniteIsRolledBackAndReported) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 7.0, 1.0}});
  AddSensor(problem, "broken", MakeSensor(Broken(), "broken"), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 1.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotFinite);
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kNotFinite);
  EXPECT_NE(report.events[0].text.find("broken"), std::string::npos);
  EXPECT_EQ(ValueOf(ekf.state(), "p.x"), 7.0);
  EXPECT_EQ(CovarianceOf(ekf.state(), "p.x", "p.x"), 1.0);
  EXPECT_FALSE(ekf.failed());
}

/// Motion model whose value overflows in the first step.
struct Exploding : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = 1e308 * (x[0] + w[0]);
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

// Tests fault 76 of tests/faults/README.md.
TEST(Ekf, AStepThatIsNotFiniteEndsWithTheLastGoodStateAndMeasurement) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Exploding(), "exploding"), {{"x", 3.0, 1.0}});
  AddSensor(problem, "direct", LinearSensor(1.0, 1.0), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  ekf.Process(FrameAt(0.0, {{0, 5.0}}));
  const UpdateReport& report = ekf.Process(FrameAt(1.0, {{0, 5.0}}));
  EXPECT_TRUE(ekf.failed());
  EXPECT_EQ(ValueOf(ekf.state(), "p.x"), 4.0);
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kNotFinite);
  EXPECT_NE(report.events[0].text.find("last good state at 0.000000 s: p.x = 4"),
            std::string::npos);
  EXPECT_NE(report.events[0].text.find("sensor 'direct' at 0.000000 s, z = 5"), std::string::npos);
  EXPECT_STREQ(ToString(report.measurements()[0].outcome), "ended");
  EXPECT_EQ(ekf.Process(FrameAt(2.0, {{0, 5.0}})).measurements()[0].outcome, Outcome::kEnded);
}

/// Counts the calls of Valid.
struct Asked : Linear {
  static inline int times = 0;
  using Linear::Linear;
  bool Valid(const double*) const {
    ++times;
    return true;
  }
};

TEST(Ekf, StaleFramesAndThoseAfterItsEndAskNoModel) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Exploding(), "exploding"), {{"x", 3.0, 1.0}});
  AddSensor(problem, "asked", MakeSensor(Asked(1.0, 1.0), "asked"), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Asked::times = 0;
  ekf.Process(FrameAt(0.0, {{0, 5.0}}));
  EXPECT_EQ(Asked::times, 1);
  EXPECT_EQ(ekf.Process(FrameAt(-1.0, {{0, 5.0}})).measurements()[0].outcome, Outcome::kStale);
  ekf.Process(FrameAt(1.0, {{0, 5.0}}));
  ASSERT_TRUE(ekf.failed());
  EXPECT_EQ(ekf.Process(FrameAt(2.0, {{0, 5.0}})).measurements()[0].outcome, Outcome::kEnded);
  EXPECT_EQ(Asked::times, 1);
}

TEST(Ekf, AFailedStepMovesNothing) {
  Problem problem = MovingPoint();
  AddMotion(problem, "q", MakeMotion(Exploding(), "exploding"), {{"x", 3.0, 1.0}});
  Ekf ekf(problem, {}, {});
  ekf.Start(0);
  const std::vector<double> x = ekf.state().values();
  const Eigen::MatrixXd p = ekf.state().covariance().Dense();
  ekf.Process(FrameAt(1.0, {}));
  EXPECT_TRUE(ekf.failed());
  EXPECT_EQ(ekf.state().values(), x);
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
}

// Tests fault 38 of tests/faults/README.md.
TEST(Ekf, AGapOfTooManyPartsIsGivenUpNotSkipped) {
  EkfOptions options;
  options.max_dt_s = 1e-9;
  Ekf ekf(MovingPoint(), options, {});
  ekf.Start(0);
  const UpdateReport& report = ekf.Process(FrameAt(10.0, {}));
  EXPECT_TRUE(ekf.failed());
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kTooManySubsteps);
}

TEST(Ekf, TheMeasurementsOwnCovarianceCountsAlsoWhereItInitialises) {
  Problem problem = DepthFilter();
  problem.sensors.pop_back();
  problem.priors[0] = {0, {}, {}, "disparity"};
  Ekf ekf(problem, {}, StreamsOf(problem));
  Frame frame = FrameAt(0.0, {{0, 65.0}});
  frame.measurements[0].covariance = {100.0};
  ekf.Process(frame);
  // The depth has sigma_Z = Z^2 / BF sigma_d.
  EXPECT_NEAR(CovarianceOf(ekf.state(), "target.depth", "target.depth"),
              std::pow(0.16 / 26.0 * 10.0, 2), 1e-12);
}

TEST(Ekf, NumbersThatAreNoneDoNotLockASensorOut) {
  const Problem problem = DepthFilter();
  Ekf ekf(problem, {}, StreamsOf(problem));
  const Eigen::MatrixXd p = ekf.state().covariance().Dense();
  for (int k = 0; k < 100; ++k) ekf.Process(FrameAt(0.0, {{1, std::nan("")}}));
  EXPECT_EQ(ekf.state().covariance().Dense(), p);
}

// An invalid covariance is a fault of the measurement, not of the filter. It therefore does not
// count as a rejection.
TEST(Ekf, CovariancesThatAreNoneDoNotLockASensorOut) {
  const Problem problem = DepthFilter();
  for (const double variance : {std::nan(""), -1e6}) {
    Ekf ekf(problem, {}, StreamsOf(problem));
    const State before = ekf.state();
    Frame frame = FrameAt(0.0, {{1, 1.0}});
    frame.measurements[0].covariance = {variance};
    for (int k = 0; k < 100; ++k) {
      const UpdateReport& report = ekf.Process(frame);
      EXPECT_EQ(report.measurements()[0].outcome,
                std::isnan(variance) ? Outcome::kNotFinite : Outcome::kInvalid);
      EXPECT_TRUE(report.events.empty());
    }
    EXPECT_EQ(ekf.state().values(), before.values());
    EXPECT_EQ(ekf.state().covariance().Dense(), before.covariance().Dense());
    frame.measurements[0].covariance = {0.0};  // zero variance: the measurement is exact
    EXPECT_EQ(ekf.Process(frame).measurements()[0].outcome, Outcome::kAccepted);
  }
}

/// Measures x twice. Only the sum of the two numbers has noise.
struct OfSum : Sensor<Vec<2>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = z[1] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[2] = T(0.1);
  }
};

// If S is not positive definite, the measurement counts as rejected, like a measurement outside the
// gate. So the covariance of the sensor's blocks is increased.
TEST(Ekf, ASensorWhoseSIsNeverPositiveDefiniteIsRecovered) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(problem, "z", MakeSensor(OfSum(), "of_sum"), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Frame frame = FrameAt(0.0, {});
  frame.measurements.push_back({0, 0, -1, {0.5, 0.5}, {}});
  int recovered = 0;
  for (int k = 0; k < 20; ++k) {
    const UpdateReport& report = ekf.Process(frame);
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotPd);
    recovered += HasEvent(report, EventKind::kRejectionRecovery);
  }
  EXPECT_EQ(recovered, 1);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.x"), 100.0, 1e-9);
}

// Tests fault 77 of tests/faults/README.md.
TEST(Ekf, ASensorThatStaysOutOfItsDomainDoesNotInflateKnownRoles) {
  Problem problem = DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  problem.sensors[0].roles[1].mode = RoleMode::kKnown;
  problem.priors[0].mean = {-1.0};
  Ekf ekf(problem, {}, StreamsOf(problem));
  for (int k = 0; k < 100; ++k) ekf.Process(FrameAt(0.0, {{0, 1.0}}));
  // There are attempts after 20, 40 and 80 rejections. The prior variance is 0.01.
  EXPECT_NEAR(CovarianceOf(ekf.state(), "target.depth", "target.depth"), 1e4, 1e-8);
  EXPECT_EQ(CovarianceOf(ekf.state(), "template.inverse_distance", "template.inverse_distance"),
            0.25);
}

TEST(Ekf, AMeasurementThatIsNotFiniteIsNotUsed) {
  const Problem problem = DepthFilter();
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, std::nan("")}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kNotFinite);
  EXPECT_EQ(ValueOf(ekf.state(), "target.depth"), 0.35);
}

// Tests fault 77 of tests/faults/README.md.
TEST(Ekf, ASensorThatIsRejectedRepeatedlyResetsItsBlockFromTheMeasurement) {
  const Problem problem = WithWrongDepth(DepthFilter());
  EkfOptions options;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  UpdateReport report;
  for (int k = 0; k < 20; ++k) report = ekf.Process(FrameAt(0.0, {{0, 65.0}}));
  ASSERT_FALSE(report.events.empty());
  EXPECT_EQ(report.events.back().kind, EventKind::kRejectionRecovery);
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth"), 26.0 / 65.0, 1e-15);
  // sigma_Z = Z^2 / BF sigma_d, and the depth is uncorrelated with the other blocks. The variance
  // of the rate is that of its prior.
  EXPECT_NEAR(std::sqrt(CovarianceOf(ekf.state(), "target.depth", "target.depth")),
              0.4 * 0.4 / 26.0, 1e-12);
  EXPECT_EQ(CovarianceOf(ekf.state(), "target.depth_rate", "target.depth_rate"), 0.25);
  EXPECT_EQ(ekf.Process(FrameAt(0.0, {{0, 65.0}})).measurements()[0].outcome, Outcome::kAccepted);
}

// After one second the variance of the rate is larger than its prior variance by 1. The reset must
// not reduce this variance.
TEST(Ekf, AResetMakesNothingMoreCertainThanItWas) {
  EkfOptions options;
  options.gate = 0.999;
  const Problem problem = DepthFilter();
  Ekf ekf(problem, options, StreamsOf(problem));
  ekf.Start(0);
  bool reset = false;
  for (int k = 0; k < 20; ++k) {
    reset = HasEvent(ekf.Process(FrameAt(1.0, {{0, 1e5}})), EventKind::kRejectionRecovery);
  }
  ASSERT_TRUE(reset);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "target.depth_rate", "target.depth_rate"), 1.25, 1e-12);
  EXPECT_EQ(CovarianceOf(ekf.state(), "target.depth", "target.depth_rate"), 0.0);
}

/// Returns the filter of a type with a gate of 0.999.
template <class Type>
Type MakeFilter(const Problem& problem, EkfOptions options = {}) {
  options.gate = 0.999;
  if constexpr (std::is_same_v<Type, Ukf>) {
    UkfOptions of_ukf;
    of_ukf.filter = options;
    return Ukf(problem, of_ukf, StreamsOf(problem));
  } else {
    return Type(problem, options, StreamsOf(problem));
  }
}

template <class Type>
class EveryFilter : public ::testing::Test {};
using Filters = ::testing::Types<Ekf, SquareRootEkf, Ukf, RtsSmoother>;
TYPED_TEST_SUITE(EveryFilter, Filters);

// The disparity 65 implies the depth 0.4, and its sigma 0.4^2 / 26. 20 measurements are rejected.
TYPED_TEST(EveryFilter, ResetsABlockAndThenAcceptsItsMeasurements) {
  const Problem problem = WithWrongDepth(DepthFilter());
  TypeParam filter = MakeFilter<TypeParam>(problem);
  for (int k = 0; k < 20; ++k) filter.Process(FrameAt(0.0, {{0, 65.0}}));
  EXPECT_NEAR(ValueOf(filter.state(), "target.depth"), 0.4, 1e-12);
  EXPECT_NEAR(CovarianceOf(filter.state(), "target.depth", "target.depth"),
              std::pow(0.4 * 0.4 / 26.0, 2), 1e-15);
  for (int k = 0; k < 3; ++k) {
    const UpdateReport& report = filter.Process(FrameAt(0.0, {{0, 65.0}}));
    EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
  }
  EXPECT_NEAR(CovarianceOf(filter.state(), "target.depth", "target.depth"),
              std::pow(0.4 * 0.4 / 26.0, 2) / 4.0, 1e-8);
}

// The sigma of x is 0.01 at first, and the jump is 10. At the third attempt, after 12 rejections,
// the sigma is 10.
TYPED_TEST(EveryFilter, InflatesUntilAMeasurementIsAccepted) {
  const Problem problem = KnownConstant();
  EkfOptions options;
  options.rejection_recovery = RejectionRecovery::kInflate;
  options.rejection_recovery_after = 3;
  TypeParam filter = MakeFilter<TypeParam>(problem, options);
  std::vector<int> recoveries;
  int first_accepted = -1;
  for (int k = 1; first_accepted < 0 && k < 100; ++k) {
    const UpdateReport& report = filter.Process(FrameAt(0.0, {{0, 10.0}}));
    if (HasEvent(report, EventKind::kRejectionRecovery)) recoveries.push_back(k);
    if (report.measurements()[0].outcome == Outcome::kAccepted) first_accepted = k;
  }
  EXPECT_EQ(recoveries, (std::vector<int>{3, 6, 12}));
  EXPECT_EQ(first_accepted, 13);
  EXPECT_NEAR(ValueOf(filter.state(), "p.x"), 10.0, 1e-3);
}

// The smoother treats the data before and after the reset separately: later measurements do not
// change earlier estimates.
TEST(RtsSmoother, ARecoveryEndsTheSmoothingOfEarlierFrames) {
  const Problem problem = KnownConstant();
  EkfOptions options;
  options.rejection_recovery_after = 3;
  RtsSmoother rts = MakeFilter<RtsSmoother>(problem, options);
  for (int k = 0; k < 10; ++k) rts.Process(FrameAt(0.1 * k, {{0, k < 4 ? 0.0 : 10.0}}));
  std::vector<double> x;
  rts.Smooth([&](std::size_t, const State& state, const UpdateReport&) {
    x.push_back(ValueOf(state, "p.x"));
  });
  ASSERT_EQ(x.size(), 10u);
  EXPECT_NEAR(x[0], 0.0, 1e-12);
  EXPECT_NEAR(x[5], 0.0, 1e-12);
  EXPECT_NEAR(x[9], 10.0, 1e-12);
}

TEST(Ekf, RecoversAfterATimeIfTheSensorIsSlow) {
  const Problem problem = KnownConstant();
  EkfOptions options;
  options.rejection_recovery_after_s = 3.0;
  Ekf ekf = MakeFilter<Ekf>(problem, options);
  ekf.Process(FrameAt(0.0, {{0, 0.0}}));
  // The first measurement after a gap may be an outlier.
  EXPECT_FALSE(HasEvent(ekf.Process(FrameAt(60.0, {{0, 5.0}})), EventKind::kRejectionRecovery));
  ekf.Process(FrameAt(61.0, {{0, 0.0}}));
  for (int k = 1; k <= 4; ++k) {
    const UpdateReport& report = ekf.Process(FrameAt(61.0 + k, {{0, 10.0}}));
    EXPECT_EQ(HasEvent(report, EventKind::kRejectionRecovery), k == 4) << k;
  }
  EXPECT_NEAR(ValueOf(ekf.state(), "p.x"), 10.0, 1e-12);
}

// The block of the sensor is constant, so no recovery helps.
TEST(Ekf, ReportsThatTheRecoveryFailedAfterFiveAttempts) {
  Ekf ekf = MakeFilter<Ekf>(WithStatus(DepthFilter(), "target.depth", BlockStatus::kConstant));
  const Frame frame = FrameAt(0.0, {{0, 2000.0}});
  std::map<EventKind, std::vector<int>> seen;
  for (int k = 1; k <= 2000; ++k) {
    for (const Event& event : ekf.Process(frame).events) seen[event.kind].push_back(k);
  }
  EXPECT_EQ(seen[EventKind::kMostlyRejected], (std::vector<int>{20}));
  EXPECT_EQ(seen[EventKind::kRejectionRecovery], (std::vector<int>{20, 40, 80, 160, 320}));
  EXPECT_EQ(seen[EventKind::kRecoveryFailed], (std::vector<int>{640}));
}

/// Motion model of a body that does not move.
struct Still : Motion<1, Vec<3>, UnitQuaternion> {
  static constexpr std::array kBlocks{Quantity{"position"}, Quantity{"orientation"}};
  template <class T>
  void Step(const T* p, const T* q, const T*, double, T* next_p, T* next_q) const {
    for (int i = 0; i < 3; ++i) next_p[i] = p[i];
    for (int i = 0; i < 4; ++i) next_q[i] = q[i];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

// A pose sensor determines the position, but here its yaw jumps by 1 rad. The recovery must correct
// the orientation: w = cos 0.5, z = sin 0.5.
TYPED_TEST(EveryFilter, CorrectsTheBlockThatExplainsTheRejections) {
  Problem problem;
  MotionBinding body{"body", MakeMotion(Still(), "still"), {}};
  for (const Space& block : body.model->blocks()) {
    const BlockId id = problem.layout.Declare("body." + block.name, "body", block);
    body.blocks.push_back(id);
    Prior prior;
    prior.block = id;
    prior.mean = problem.layout[id].geometry().Identity();
    prior.covariance = 1e-4 * Eigen::MatrixXd::Identity(3, 3);
    problem.priors.push_back(prior);
  }
  problem.motions.push_back(body);
  AddSensor(problem, "pose", MakeSensor(Pose<3>({0.01, 0.01, 0.01}, {0.005, 0.005, 0.005}), "pose"),
            {"body.position", "body.orientation"});
  TypeParam filter = MakeFilter<TypeParam>(problem);
  Frame frame = FrameAt(0.0, {});
  frame.measurements.push_back({0, 0, -1, {0, 0, 0, std::cos(0.5), 0, 0, std::sin(0.5)}, {}});
  for (int k = 0; k < 30; ++k) filter.Process(frame);
  EXPECT_EQ(filter.Process(frame).measurements()[0].outcome, Outcome::kAccepted);
  const double* const q = filter.state().value(problem.layout.Find("body.orientation"));
  EXPECT_NEAR(q[0], std::cos(0.5), 1e-4);
  EXPECT_NEAR(q[3], std::sin(0.5), 1e-4);
}

/// Motion model x' = x + w for each of the two blocks. The noises of the two blocks are
/// independent.
struct Pair : Motion<2, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"a"}, Quantity{"b"}};
  template <class T>
  void Step(const T* a, const T* b, const T* w, double, T* next_a, T* next_b) const {
    next_a[0] = a[0] + w[0];
    next_b[0] = b[0] + w[1];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = l(1, 1) = 1e-3; }
};

/// Measures z = a + b. z determines b if a is known.
struct Sum : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"b"}};
  static constexpr Quantity kMeasurement{"z"};
  static constexpr int kInitialises = 1;
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0] + b[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.1);
  }
  template <class T>
  bool Initialise(const T* a, const T* z, T* b) const {
    b[0] = z[0] - a[0];
    return true;
  }
};

// Block b is reset to z - a. Block a has the same motion model, so a is first reset to its prior.
// After both resets, b is correlated with a.
TEST(Ekf, ABlockThatIsResetIsCorrelatedWithWhatItWasResetFrom) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Pair(), "pair"), {{"a", 1.0, 0.5}, {"b", 2.0, 1e-3}});
  AddSensor(problem, "sum", MakeSensor(Sum(), "sum"), {"p.a", "p.b"});
  AddSensor(problem, "direct", LinearSensor(1.0, 0.01), {"p.a"});
  EkfOptions options;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  ekf.Process(FrameAt(0.0, {{1, 1.0}}));
  for (int k = 0; k < 20; ++k) ekf.Process(FrameAt(0.0, {{0, 50.0}}));
  EXPECT_NEAR(ValueOf(ekf.state(), "p.b"), 49.0, 1e-3);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.a", "p.a"), 0.25, 1e-12);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.a", "p.b"), -0.25, 1e-12);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.b", "p.b"), 0.25 + 0.01, 1e-12);
}

/// Measures z = (a, b).
struct Both : Sensor<Vec<2>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"a"}, Quantity{"b"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    z[0] = a[0];
    z[1] = b[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(1.0);
  }
};

// Each triangle alone would define a valid covariance.
TEST(Ekf, AnAsymmetricCovarianceOfAMeasurementIsInvalid) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Pair(), "pair"), {{"a", 1.0, 0.5}, {"b", 2.0, 0.5}});
  AddSensor(problem, "both", MakeSensor(Both(), "both"), {"p.a", "p.b"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Frame frame = FrameAt(0.0, {{0, 1.0}});
  frame.measurements[0].values = {1.0, 2.0};
  for (const double other : {5.0, 0.1}) {
    frame.measurements[0].covariance = {1.0, 0.1, other, 1.0};
    EXPECT_EQ(ekf.Process(frame).measurements()[0].outcome,
              other == 0.1 ? Outcome::kAccepted : Outcome::kInvalid);
    frame.measurements[0].covariance = {1.0, other, 0.1, 1.0};
    EXPECT_EQ(ekf.Process(frame).measurements()[0].outcome,
              other == 0.1 ? Outcome::kAccepted : Outcome::kInvalid);
  }
}

TEST(Ekf, BlocksStartFromMeasurementsWithTheirCorrelation) {
  Problem problem = DepthFilter();
  problem.priors[0] = {0, {}, {}, "disparity"};
  problem.priors[2] = {2, {}, {}, "inverse_scale"};
  Ekf ekf(problem, {}, StreamsOf(problem));
  // A measurement of the scale cannot initialise its block as long as the depth has no value.
  EXPECT_EQ(ekf.Process(FrameAt(0.0, {{1, 1.0}})).measurements()[0].outcome, Outcome::kNotReady);
  const UpdateReport& report = ekf.Process(FrameAt(0.1, {{1, 1.0}, {0, 52.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kInitialised);
  EXPECT_EQ(report.measurements()[1].outcome, Outcome::kInitialised);
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth"), 0.5, 1e-15);
  EXPECT_NEAR(ValueOf(ekf.state(), "template.inverse_distance"), 2.0, 1e-15);
  // lambda = s / Z, so d lambda = ds / Z - s / Z^2 dZ. At s = 1, sigma_s = 2/300.
  const double variance_z = std::pow(0.25 / 26.0, 2), variance_s = std::pow(2.0 / 300.0, 2);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "target.depth", "target.depth"), variance_z, 1e-15);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "template.inverse_distance", "target.depth"),
              -4.0 * variance_z, 1e-15);
  EXPECT_NEAR(CovarianceOf(ekf.state(), "template.inverse_distance", "template.inverse_distance"),
              16.0 * variance_z + 4.0 * variance_s, 1e-14);
}

TEST(Ekf, ABlockStartsFromTheSensorThatTheConfigNames) {
  Problem problem = DepthFilter();
  problem.priors[0] = {0, {}, {}, "disparity"};
  SensorBinding other = problem.sensors[0];
  other.name = other.stream = "other";
  problem.sensors.push_back(other);
  Ekf ekf(problem, {}, StreamsOf(problem));
  EXPECT_EQ(ekf.Process(FrameAt(0.0, {{2, 65.0}})).measurements()[0].outcome, Outcome::kNotReady);
  EXPECT_EQ(ekf.Process(FrameAt(0.1, {{0, 52.0}})).measurements()[0].outcome,
            Outcome::kInitialised);
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth"), 0.5, 1e-15);
}

TEST(Ekf, AHeldRoleIsExactWhereABlockStartsFromIt) {
  Problem problem = DepthFilter();
  problem.sensors.erase(problem.sensors.begin());
  problem.sensors[0].roles[0].mode = RoleMode::kKnown;
  problem.priors[2] = {2, {}, {}, "inverse_scale"};
  Ekf ekf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ekf.Process(FrameAt(0.0, {{0, 1.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kInitialised);
  EXPECT_EQ(CovarianceOf(ekf.state(), "template.inverse_distance", "target.depth"), 0.0);
  // lambda = s / Z with an exact Z = 0.35. At s = 1, sigma_s = 2/300.
  EXPECT_NEAR(CovarianceOf(ekf.state(), "template.inverse_distance", "template.inverse_distance"),
              std::pow(2.0 / 300.0 / 0.35, 2), 1e-15);
}

TEST(Ekf, ASensorThatIsRejectedRepeatedlyOfFixedBlocksInflatesNothing) {
  const auto event_of = [](BlockStatus status) {
    const Problem problem = WithWrongDepth(WithStatus(DepthFilter(), "target.depth", status));
    EkfOptions options;
    options.gate = 0.999;
    options.rejection_recovery = RejectionRecovery::kInflate;
    Ekf ekf(problem, options, StreamsOf(problem));
    UpdateReport report;
    for (int k = 0; k < 20; ++k) report = ekf.Process(FrameAt(0.0, {{0, 65.0}}));
    return report.events.empty() ? "" : report.events.back().text;
  };
  const std::string why = "sensor 'disparity' was rejected 20 times in a row: ";
  EXPECT_EQ(event_of(BlockStatus::kEstimated),
            why + "the sigmas of its blocks were multiplied by 10");
  EXPECT_EQ(event_of(BlockStatus::kConstant), why + "the sensor has no estimated block to inflate");
  EXPECT_EQ(event_of(BlockStatus::kConsider), why + "the sensor has no estimated block to inflate");
}

TEST(Ekf, AResetLeavesConsideredBlocksAsTheyAre) {
  const Problem problem =
      WithWrongDepth(WithStatus(DepthFilter(), "target.depth_rate", BlockStatus::kConsider));
  EkfOptions options;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  ekf.Start(0);
  UpdateReport report;
  for (int k = 0; k < 20; ++k) report = ekf.Process(FrameAt(1.0, {{0, 65.0}}));
  ASSERT_EQ(report.events.back().kind, EventKind::kRejectionRecovery);
  EXPECT_NEAR(ValueOf(ekf.state(), "target.depth"), 0.4, 1e-15);
  // The variance is 0.25 from the prior and 1 from the acceleration over one second.
  EXPECT_EQ(CovarianceOf(ekf.state(), "target.depth_rate", "target.depth_rate"), 1.25);
}

/// Measures z = x + y. z determines y, whose role is optional.
struct WithOptional : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"},
                                     Quantity{"y", "", "", "", ALIDADE_ROLE_OPTIONAL}};
  static constexpr Quantity kMeasurement{"z"};
  static constexpr int kInitialises = 1;
  template <class T>
  bool Predict(const T* x, const T* y, T* z) const {
    z[0] = y == nullptr ? x[0] : x[0] + y[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1e-3);
  }
  template <class T>
  bool Initialise(const T* x, const T* z, T* y) const {
    y[0] = z[0] - x[0];
    return true;
  }
};

TEST(Ekf, ASensorThatIsRejectedRepeatedlyWhoseRoleIsUnboundWidensItsOtherBlock) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(problem, "s", MakeSensor(WithOptional(), "with_optional"), {"p.x"});
  problem.sensors[0].roles.push_back({});
  EkfOptions options;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  UpdateReport report;
  for (int k = 0; k < 20; ++k) report = ekf.Process(FrameAt(0.0, {{0, 100.0}}));
  ASSERT_FALSE(report.events.empty());
  EXPECT_EQ(
      report.events.back().text,
      "sensor 's' was rejected 20 times in a row: the sigma of block 'p.x', which explains the "
      "rejections best, was increased by the required correction of 100");
  EXPECT_NEAR(CovarianceOf(ekf.state(), "p.x", "p.x"), 1.0 + 100.0 * 100.0, 1e-9);
}

TEST(Ekf, ThatASensorLeftItsDomainIsNotedAlsoAfterAGatedMeasurement) {
  Problem problem = DepthFilter();
  problem.priors[1].mean = {-1.0};
  EkfOptions options;
  options.gate = 0.999;
  Ekf ekf(problem, options, StreamsOf(problem));
  EXPECT_EQ(ekf.Process(FrameAt(0.0, {{0, 1e6}})).measurements()[0].outcome, Outcome::kGated);
  EXPECT_FALSE(ekf.diverged());
  const UpdateReport& report = ekf.Process(FrameAt(1.0, {{0, 80.0}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kOutOfDomain);
  EXPECT_TRUE(ekf.diverged());
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kDiverged);
  EXPECT_TRUE(ekf.Process(FrameAt(1.0, {{0, 80.0}})).events.empty());
}

}  // namespace
}  // namespace alidade
