// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/error.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/rts.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "alidade/model/static_ekf.h"
#include "motion_models/constant.h"
#include "support/driven.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kFix = 0, kOdometry = 1;
// kNoise is in m/s^0.5, and kSigma is in m.
constexpr double kNoise = 0.2, kSigma = 0.3;

const std::vector<StreamInfo> kStreams = {{"fix", 1}, {"odometry", 1}};

/// Returns a problem with the state `car.position`, 1 +- 0.5 m. The stream `odometry` drives it,
/// and the sensor `fix` measures it.
Problem Car(double timeout_s = kInfinity) {
  Problem problem;
  AddMotion(problem, "car", MakeMotion(Driven(kNoise), "driven"), {{"position", 1.0, 0.5}});
  problem.motions[0].input = {"odometry", timeout_s};
  AddSensor(problem, "fix", LinearSensor(1.0, kSigma), {"car.position"});
  return problem;
}

/// One row of the drive: time in s, fix in m, speed in m/s. NaN means that the row has no such
/// value.
struct Seen {
  double t_s, fix, speed;
};
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
const std::vector<Seen> kDrive = {
    {0.0, 1.2, kNone}, {0.5, kNone, 2.0}, {1.0, 2.3, 1.5},   {1.7, kNone, kNone}, {2.0, 3.1, -1.0},
    {2.5, kNone, 0.5}, {3.0, 3.6, kNone}, {6.0, 3.5, kNone}, {6.5, 4.2, 1.0},     {7.0, 4.3, 0.8}};

Frame FrameOf(const Seen& seen) {
  Frame frame = FrameAt(seen.t_s, {});
  if (!std::isnan(seen.fix))
    frame.measurements.push_back({frame.timestamp, kFix, -1, {seen.fix}, {}});
  if (!std::isnan(seen.speed)) {
    frame.measurements.push_back({frame.timestamp, kOdometry, -1, {seen.speed}, {}});
  }
  return frame;
}

struct Gaussian {
  double x, p;
};

/// Kalman filter in closed form. The displacement between two rows is the integral of u(t). The
/// input u is the last speed until `timeout_s` after its row, and then 0. P grows by kNoise^2 dt.
std::vector<Gaussian> WrittenOut(const std::vector<Seen>& drive, double timeout_s) {
  std::vector<Gaussian> estimates;
  double x = 1.0, p = 0.25, t = drive[0].t_s, speed = 0.0, since = t;
  for (const Seen& row : drive) {
    const double acting = std::clamp(since + timeout_s - t, 0.0, row.t_s - t);
    x += speed * acting;
    p += kNoise * kNoise * (row.t_s - t);
    t = row.t_s;
    if (!std::isnan(row.fix)) {
      const double gain = p / (p + kSigma * kSigma);
      x += gain * (row.fix - x);
      p *= 1.0 - gain;
    }
    if (!std::isnan(row.speed)) {
      speed = row.speed;
      since = t;
    }
    estimates.push_back({x, p});
  }
  return estimates;
}

/// Compares the filter with WrittenOut. Returns the kinds of all events in order.
std::vector<std::string> ExpectWrittenOut(Estimator& filter, const std::vector<Seen>& drive,
                                          double timeout_s, double tolerance) {
  std::vector<std::string> kinds;
  const std::vector<Gaussian> expected = WrittenOut(drive, timeout_s);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    const UpdateReport& report = filter.Process(FrameOf(drive[k]));
    for (const Event& event : report.events) kinds.emplace_back(ToString(event.kind));
    EXPECT_EQ(report.inputs.size(), std::isnan(drive[k].speed) ? 0u : 1u);
    EXPECT_EQ(report.measurements().size(), std::isnan(drive[k].fix) ? 0u : 1u);
    EXPECT_NEAR(ValueOf(filter.state(), "car.position"), expected[k].x, tolerance) << k;
    EXPECT_NEAR(CovarianceOf(filter.state(), "car.position", "car.position"), expected[k].p,
                tolerance)
        << k;
  }
  return kinds;
}

/// Returns `problem` with an additional constant block.
Problem WithConstantBlock(Problem problem) {
  const BlockId id =
      problem.layout.Declare("aside.x", "aside", problem.layout[0].space, BlockStatus::kConstant);
  problem.priors.push_back({id, {1.0}, Eigen::MatrixXd::Zero(1, 1), ""});
  return problem;
}

TEST(ControlInputs, AreHeldFromTheirTimestampOnByEveryFilter) {
  const std::vector<std::string> first = {"input_stale"};  // there is no input from 0 s to 0.5 s
  for (const Problem& problem : {Car(), WithConstantBlock(Car())}) {
    Ekf ekf(problem, {}, kStreams);
    EXPECT_EQ(ExpectWrittenOut(ekf, kDrive, kInfinity, 1e-12), first);
    Iekf iekf(problem, {}, kStreams);
    EXPECT_EQ(ExpectWrittenOut(iekf, kDrive, kInfinity, 1e-12), first);
    SquareRootEkf root(problem, {}, kStreams);
    EXPECT_EQ(ExpectWrittenOut(root, kDrive, kInfinity, 1e-12), first);
    Ukf ukf(problem, {}, kStreams);
    EXPECT_EQ(ExpectWrittenOut(ukf, kDrive, kInfinity, 1e-9), first);
  }
}

TEST(ControlInputs, StopActingInTheMiddleOfAStepWhenTheyAreTooOld) {
  for (const Problem& problem : {Car(0.4), WithConstantBlock(Car(0.4))}) {
    Ekf ekf(problem, {}, kStreams);
    std::vector<std::string> kinds = ExpectWrittenOut(ekf, kDrive, 0.4, 1e-12);
    // One event comes before the first input. The next input comes at least 0.5 s later each time,
    // so one event also follows each input except the last.
    EXPECT_EQ(kinds, std::vector<std::string>(6, "input_stale"));
    Ukf ukf(problem, {}, kStreams);
    ExpectWrittenOut(ukf, kDrive, 0.4, 1e-9);
  }
  Ekf ekf(Car(1.5), {}, kStreams);
  // No input acts before the first row with a speed, and none acts from 4 s to 6.5 s. The second
  // gap spans two frames but causes only one event.
  EXPECT_EQ(ExpectWrittenOut(ekf, kDrive, 1.5, 1e-12), std::vector<std::string>(2, "input_stale"));
}

TEST(ControlInputs, ActInEveryPartOfAGapThatIsSteppedInParts) {
  EkfOptions options;
  options.max_dt_s = 0.1;
  for (const double timeout_s : {kInfinity, 0.45}) {
    Ekf ekf(Car(timeout_s), options, kStreams);
    std::vector<std::string> kinds = ExpectWrittenOut(ekf, kDrive, timeout_s, 1e-12);
    std::erase(kinds, "input_stale");
    // The gap of 0.5 s is divided into 5 parts. Only the gap of 3 s is divided into at least twice
    // as many: 30.
    EXPECT_EQ(kinds, std::vector<std::string>(2, "substeps")) << timeout_s;
  }
  Ekf ekf(Car(), options, kStreams);
  ekf.Process(FrameOf(kDrive[0]));
  const UpdateReport& report = ekf.Process(FrameOf(kDrive[1]));
  ASSERT_EQ(report.events.size(), 2u);
  EXPECT_EQ(report.events[0].text,
            "no control input of 'car' from stream 'odometry' has arrived yet: the motion model "
            "uses u = 0");
  EXPECT_EQ(report.events[1].text,
            "a gap of 0.5 s, longer than max_dt_s = 0.1, is divided into 5 equal steps");
  EXPECT_EQ(report.events[1].timestamp, 500'000'000);
}

TEST(ControlInputs, AnOldOneIsToldOnceUntilOneActsAgain) {
  Ekf ekf(Car(0.5), {}, kStreams);
  std::vector<std::string> texts;
  const auto step = [&](double t_s, double speed) {
    for (const Event& event : ekf.Process(FrameOf({t_s, kNone, speed})).events) {
      texts.push_back(event.text);
    }
  };
  step(0.0, 1.0);
  step(0.5, kNone);  // the age of the input equals the timeout
  EXPECT_TRUE(texts.empty());
  for (const double t_s : {0.6, 0.7, 0.8}) step(t_s, kNone);
  EXPECT_EQ(texts, std::vector<std::string>{"the control input of 'car' from stream 'odometry' is "
                                            "older than 0.5 s: the motion model uses u = 0"});
  step(0.9, 1.0);
  step(1.0, kNone);
  EXPECT_EQ(texts.size(), 1u);
  step(3.0, kNone);
  EXPECT_EQ(texts.size(), 2u);
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 1.0 + 0.5 + 0.5, 1e-15);
}

TEST(ControlInputs, OneThatIsNotFiniteIsRefusedAndTheOneBeforeGoesOn) {
  Ekf ekf(Car(), {}, kStreams);
  ekf.Process(FrameOf({0.0, kNone, 2.0}));
  const UpdateReport& report = ekf.Process(FrameAt(1.0, {{kOdometry, kNone}}));
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kInputRefused);
  EXPECT_EQ(report.events[0].text,
            "a control input of 'car' from stream 'odometry' is not finite: the previous input "
            "remains in use");
  EXPECT_TRUE(report.inputs.empty());
  EXPECT_TRUE(ekf.Process(FrameAt(2.0, {{kOdometry, kInfinity}})).events.empty());
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 5.0, 1e-15);
  EXPECT_TRUE(ekf.Process(FrameAt(3.0, {{kOdometry, 1.0}})).events.empty());
  EXPECT_EQ(ekf.Process(FrameAt(4.0, {{kOdometry, kNone}})).events.size(), 1u);
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 8.0, 1e-15);
  EXPECT_FALSE(ekf.failed());
}

// With `policy: reject` a late frame can still reach the filter.
TEST(ControlInputs, ALateOneActsFromTheNextStepOnUnlessANewerOneIsHeld) {
  Ekf ekf(Car(), {}, kStreams);
  ekf.Process(FrameOf({0.0, kNone, 2.0}));
  ekf.Process(FrameOf({1.0, kNone, kNone}));
  EXPECT_TRUE(ekf.Process(FrameOf({0.5, 9.0, 4.0})).stale);
  // The late frame does not repeat the step.
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 3.0, 1e-15);
  ekf.Process(FrameOf({2.0, kNone, 5.0}));
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 7.0, 1e-15);
  EXPECT_TRUE(ekf.Process(FrameOf({1.9, kNone, 100.0})).inputs.empty());
  ekf.Process(FrameOf({3.0, kNone, kNone}));
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 12.0, 1e-15);
}

TEST(ControlInputs, TheirCovarianceIsNotUsed) {
  Ekf with(Car(), {}, kStreams), without(Car(), {}, kStreams);
  for (const Seen& row : kDrive) {
    Frame frame = FrameOf(row);
    without.Process(frame);
    for (Measurement& m : frame.measurements) {
      if (m.stream == kOdometry) m.covariance = {100.0};
    }
    with.Process(frame);
  }
  EXPECT_EQ(with.state().values(), without.state().values());
  EXPECT_EQ(with.state().covariance().Dense(), without.state().covariance().Dense());
}

template <class Filter, class Options>
void ExpectTheSameAfterGoingBack(const Options& options) {
  Filter filter(Car(0.6), options, kStreams), straight(Car(0.6), options, kStreams);
  filter.Process(FrameOf({0.0, 1.2, 2.0}));
  const Filter saved = filter;
  filter.Process(FrameOf({0.3, 2.0, -7.0}));
  filter.Process(FrameOf({5.0, 2.0, kNone}));
  filter = saved;
  straight.Process(FrameOf({0.0, 1.2, 2.0}));
  for (const Seen& next : {Seen{0.5, 2.1, kNone}, Seen{2.0, 2.2, kNone}, Seen{2.5, 2.2, kNone}}) {
    const UpdateReport& one = filter.Process(FrameOf(next));
    const UpdateReport& two = straight.Process(FrameOf(next));
    ASSERT_EQ(one.events.size(), two.events.size()) << next.t_s;
    EXPECT_EQ(one.events.size(), next.t_s == 2.0 ? 1u : 0u);
    EXPECT_EQ(filter.state().values(), straight.state().values());
    EXPECT_EQ(filter.state().covariance().Dense(), straight.state().covariance().Dense());
  }
}

TEST(ControlInputs, AFilterGoesBackToTheOneItHeld) {
  ExpectTheSameAfterGoingBack<Ekf>(EkfOptions{});
  ExpectTheSameAfterGoingBack<Iekf>(IekfOptions{});
  ExpectTheSameAfterGoingBack<SquareRootEkf>(EkfOptions{});
  ExpectTheSameAfterGoingBack<Ukf>(UkfOptions{});
}

// With F = 1 the recursion of the smoother is
// x_s = x + C (x_s' - x'), P_s = P + C^2 (P_s' - P'), C = P / P'.
TEST(ControlInputs, DriveTheSmootherToo) {
  constexpr double kMaxAge = 0.4;
  RtsSmoother rts(Car(kMaxAge), {}, kStreams);
  for (const Seen& row : kDrive) rts.Process(FrameOf(row));
  std::vector<Gaussian> smoothed = WrittenOut(kDrive, kMaxAge);
  for (std::size_t k = kDrive.size() - 1; k-- > 0;) {
    std::vector<Seen> until(kDrive.begin(), kDrive.begin() + static_cast<std::ptrdiff_t>(k) + 2);
    until.back().fix = kNone;
    const Gaussian predicted = WrittenOut(until, kMaxAge).back();
    const double c = smoothed[k].p / predicted.p;
    smoothed[k].x += c * (smoothed[k + 1].x - predicted.x);
    smoothed[k].p += c * c * (smoothed[k + 1].p - predicted.p);
  }
  std::size_t count = 0;
  rts.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
    EXPECT_NEAR(ValueOf(state, "car.position"), smoothed[k].x, 1e-12) << k;
    EXPECT_NEAR(CovarianceOf(state, "car.position", "car.position"), smoothed[k].p, 1e-12) << k;
    EXPECT_EQ(report.inputs.size(), std::isnan(kDrive[k].speed) ? 0u : 1u);
    ++count;
  });
  EXPECT_EQ(count, kDrive.size());
}

/// Motion model x' = x + q_w dt. The input is a unit quaternion q, whose neutral element is not
/// zero.
struct TurnedByInput : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  using Input = UnitQuaternion;
  static constexpr Quantity kInput{"orientation", "", "", "w,x,y,z"};
  template <class T>
  void Step(const T* x, const T* q, const T* w, double dt_s, T* next) const {
    next[0] = x[0] + q[0] * dt_s + w[0];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TEST(ControlInputs, OnAManifoldStartAtItsNeutralElementAndStayOnIt) {
  Problem problem;
  AddMotion(problem, "body", MakeMotion(TurnedByInput(), "turned"), {{"x", 0.0, 1.0}});
  problem.motions[0].input = {"attitude", kInfinity};
  problem.initial_time_s = -1.0;
  Ekf ekf(problem, {}, {{"attitude", 4}});
  const auto frame = [](double t_s, const std::vector<double>& q) {
    return Frame{TimestampFromSeconds(t_s), {{TimestampFromSeconds(t_s), 0, -1, q, {}}}};
  };
  ekf.Process(frame(0.0, {0.60006, 0.80008, 0.0, 0.0}));  // the norm of q is 1e-4 too large
  EXPECT_NEAR(ValueOf(ekf.state(), "body.x"), 1.0, 1e-15);
  const UpdateReport& report = ekf.Process(frame(1.0, {2.0, 0.0, 0.0, 0.0}));
  EXPECT_NEAR(ValueOf(ekf.state(), "body.x"), 1.6, 1e-15);
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_NE(report.events[0].text.find("does not have unit length"), std::string::npos);
  ekf.Process(frame(2.0, {1.0, 0.0, 0.0, 0.0}));
  EXPECT_NEAR(ValueOf(ekf.state(), "body.x"), 2.2, 1e-15);
}

TEST(ControlInputs, EachModelHasItsOwnAndTheyEndOneByOne) {
  Problem problem = Car(0.5);
  AddMotion(problem, "other", MakeMotion(Driven(0.1), "driven"), {{"position", 0.0, 1.0}});
  problem.motions[1].input = {"odometry", 2.0};
  AddMotion(problem, "third", MakeMotion(Driven(0.1), "driven"), {{"position", 0.0, 1.0}});
  problem.motions[2].input = {"wheel", 1.0};
  AddMotion(problem, "still", testing::ConstantMotion(1, 0.1), {{"value", 3.0, 1.0}});
  Ekf ekf(problem, {}, {{"fix", 1}, {"odometry", 1}, {"wheel", 1}});
  EXPECT_EQ(ekf.Process(FrameAt(0.0, {{1, 2.0}, {2, 10.0}})).inputs, (std::vector{0, 1, 2}));
  const UpdateReport& report = ekf.Process(FrameAt(4.0, {}));
  EXPECT_EQ(report.events.size(), 3u);
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 1.0 + 2.0 * 0.5, 1e-14);
  EXPECT_NEAR(ValueOf(ekf.state(), "other.position"), 2.0 * 2.0, 1e-14);
  EXPECT_NEAR(ValueOf(ekf.state(), "third.position"), 10.0 * 1.0, 1e-14);
  EXPECT_EQ(ValueOf(ekf.state(), "still.value"), 3.0);
}

TEST(ControlInputs, OfAnotherSizeThanTheStreamAreAMisuse) {
  EXPECT_THROW(Ekf(Car(), {}, {{"fix", 1}, {"odometry", 2}}), ContractViolation);
}

/// A point moves in the direction of its heading. The heading is observable only while the point
/// moves.
struct Heading : Motion<1, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}, Quantity{"heading"}};
  using Input = Vec<1>;
  static constexpr Quantity kInput{"speed"};
  template <class T>
  void Step(const T* x, const T* heading, const T* u, const T* w, double dt_s, T* next,
            T* next_heading) const {
    using std::cos;
    next[0] = x[0] + u[0] * cos(heading[0]) * dt_s;
    next_heading[0] = heading[0] + w[0] * dt_s;
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TEST(ControlInputs, WhatCannotBeObservedIsJudgedInMotion) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Heading(), "heading"),
            {{"x", 0.0, 1.0}, {"heading", 0.5, 1.0}});
  AddSensor(problem, "fix", LinearSensor(1.0, 0.3), {"p.x"});
  EXPECT_TRUE(UnobservableDirections(problem).empty());
}

TEST(ControlInputs, OfTheStaticFilterAreThoseOfTheEngine) {
  Ekf engine(Car(), {}, kStreams);
  StaticEkf<Constant<1>, Driven> filter(Constant<1>(1), Driven(kNoise));
  filter.Set<0>(7.0, 1.0);
  filter.Set<1>(1.0, 0.5);
  double t_s = 0.0, speed = 0.0;
  for (const Seen& row : kDrive) {
    engine.Process(FrameOf(row));
    ASSERT_EQ(filter.Predict(row.t_s - t_s, &speed), Status::kOk);
    if (!std::isnan(row.fix)) filter.Update<1>(Linear(1.0, kSigma), &row.fix);
    if (!std::isnan(row.speed)) speed = row.speed;
    t_s = row.t_s;
    EXPECT_NEAR(*filter.value<1>(), ValueOf(engine.state(), "car.position"), 1e-12);
    EXPECT_NEAR(filter.covariance()(1, 1),
                CovarianceOf(engine.state(), "car.position", "car.position"), 1e-12);
  }
}

// If two frames with the same timestamp are processed one after the other, the input of the second
// frame acts.
TEST(ControlInputs, OfTwoAtOneTimestampTheLaterActs) {
  const Problem problem = Car();
  Ekf ekf(problem, {}, kStreams);
  ekf.Process(FrameAt(0.0, {{kOdometry, 2.0}}));
  ekf.Process(FrameAt(0.0, {{kOdometry, -1.0}}));
  ekf.Process(FrameAt(1.5, {}));
  EXPECT_NEAR(ValueOf(ekf.state(), "car.position"), 1.0 - 1.5, 1e-12);
}

}  // namespace
}  // namespace alidade
