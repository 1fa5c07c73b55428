// SPDX-License-Identifier: Apache-2.0
//
// Tests late measurements: with rollback, the result is bit-identical to that of the frames in
// order.
#include "alidade/estimation/rollback.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "alidade/base/error.h"
#include "alidade/base/random.h"
#include "alidade/estimation/ekf.h"
#include "alidade/estimation/iekf.h"
#include "alidade/estimation/square_root_ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/systems.h"

namespace alidade::testing {
namespace {

constexpr double kWindow_s = 0.2;

/// Returns frames of a target that oscillates between 0.2 and 0.4 m. Every tenth disparity is an
/// outlier.
std::vector<Frame> Swinging(int count) {
  Random random(1);
  std::vector<Frame> frames;
  for (int k = 0; k < count; ++k) {
    const double t_s = 0.033 * k, depth = 0.3 + 0.1 * std::sin(2.5 * t_s);
    const double wild = k % 10 == 7 ? 40.0 : 0.0;
    frames.push_back(FrameAt(t_s, {{0, 26.0 / depth + random.Normal() + wild},
                                   {1, depth / 0.3 + 0.003 * random.Normal()}}));
  }
  return frames;
}

/// Delays each frame by at most `most_s`. Returns the frames in the order of their arrival.
std::vector<Frame> Delayed(const std::vector<Frame>& frames, double most_s) {
  Random random(2);
  std::multimap<double, Frame> arrivals;
  for (const Frame& frame : frames) {
    arrivals.emplace(Seconds(frame.timestamp) + most_s * random.Uniform(), frame);
  }
  std::vector<Frame> delayed;
  for (const auto& [t_s, frame] : arrivals) delayed.push_back(frame);
  return delayed;
}

/// Returns the full content of a report as text, without rounding.
std::string Text(const UpdateReport& report) {
  std::string text = report.stale ? "stale" : "";
  for (const MeasurementReport& m : report.measurements()) {
    text += ToString(m.outcome);
    for (const auto* numbers : {&m.z, &m.h, &m.innovation, &m.s, &m.gain}) {
      for (const double number : *numbers) {
        char digits[40];
        text.append(digits,
                    static_cast<std::size_t>(std::snprintf(digits, sizeof digits, " %a", number)));
      }
    }
    text += '\n';
  }
  for (const Event& event : report.events)
    text += std::string(ToString(event.kind)) + ": " + event.text + '\n';
  return text;
}

void ExpectSame(const State& a, const State& b) {
  EXPECT_EQ(a.values(), b.values());
  EXPECT_EQ(a.covariance().Dense(), b.covariance().Dense());
}

/// Runs the same frames with delays and in order, and compares the two runs.
template <class Type, class Options>
void ExpectTheBitsOfTheInOrderRun(const Options& options) {
  const Problem problem = DepthFilter();
  const std::vector<Frame> frames = Swinging(60);
  Type in_order(problem, options, StreamsOf(problem));
  std::map<Timestamp, std::string> expected, found;
  for (const Frame& frame : frames) expected[frame.timestamp] = Text(in_order.Process(frame));
  Rollback late(Type(problem, options, StreamsOf(problem)), kWindow_s);
  std::size_t processed = 0;
  for (const Frame& frame : Delayed(frames, kWindow_s)) {
    for (const ProcessedFrame& one : late.Process(frame)) {
      found[one.frame.timestamp] = Text(one.report);
      EXPECT_EQ(one.snapshot->timestamp(), one.frame.timestamp);
      ++processed;
    }
  }
  EXPECT_EQ(found, expected);
  EXPECT_GT(processed, frames.size() + 40);  // checks that rollbacks occurred
  ExpectSame(late.filter().state(), in_order.state());
  const Timestamp soon = in_order.timestamp() + TimestampFromSeconds(0.05);
  ExpectSame(late.filter().At(soon), in_order.At(soon));
}

TEST(Rollback, GivesTheBitsOfTheInOrderRun) {
  EkfOptions options;
  options.gate = 0.99;
  options.rejection_recovery_after = 2;  // each copy of the filter has its own counter
  ExpectTheBitsOfTheInOrderRun<Ekf>(options);
  ExpectTheBitsOfTheInOrderRun<SquareRootEkf>(options);
  ExpectTheBitsOfTheInOrderRun<Iekf>(IekfOptions{options});
  ExpectTheBitsOfTheInOrderRun<Ukf>(UkfOptions{options});
}

TEST(Rollback, AFrameGivesItsReportAndThoseOfTheLaterOnes) {
  const Problem problem = DepthFilter();
  Rollback late(Ekf(problem, {}, StreamsOf(problem)), 1.0);
  const auto timestamps = [&](double t_s) {
    std::vector<double> found;
    for (const ProcessedFrame& one : late.Process(FrameAt(t_s, {{0, 80.0}}))) {
      found.push_back(Seconds(one.frame.timestamp));
    }
    return found;
  };
  using Times = std::vector<double>;
  EXPECT_EQ(timestamps(1.0), Times{1.0});
  EXPECT_EQ(timestamps(1.5), Times{1.5});
  EXPECT_EQ(timestamps(2.0), Times{2.0});
  EXPECT_EQ(timestamps(1.25), (Times{1.25, 1.5, 2.0}));
  EXPECT_EQ(timestamps(2.0), Times{2.0});  // the earlier arrival at 2.0 s comes first
  EXPECT_EQ(timestamps(1.0),
            // The frame at 1.0 s is exactly at the edge of the window.
            (Times{1.0, 1.25, 1.5, 2.0, 2.0}));
  EXPECT_EQ(timestamps(2.125), Times{2.125});
}

TEST(Rollback, AFrameBeforeTheFirstBecomesTheFirst) {
  const Problem problem = DepthFilter();
  Ekf in_order(problem, {}, StreamsOf(problem));
  Rollback late(in_order, 1.0);
  late.Process(FrameAt(0.5, {{0, 80.0}}));
  late.Process(FrameAt(0.0, {{0, 78.0}}));
  in_order.Process(FrameAt(0.0, {{0, 78.0}}));
  in_order.Process(FrameAt(0.5, {{0, 80.0}}));
  ExpectSame(late.filter().state(), in_order.state());
}

TEST(Rollback, AFrameBeyondTheWindowIsRefusedAsStaleAndChangesNothing) {
  const Problem problem = DepthFilter();
  Rollback late(Ekf(problem, {}, StreamsOf(problem)), 0.5);
  Ekf in_order(problem, {}, StreamsOf(problem));
  for (const double t_s : {1.0, 1.5, 2.0}) {
    late.Process(FrameAt(t_s, {{0, 80.0}}));
    in_order.Process(FrameAt(t_s, {{0, 80.0}}));
  }
  const Rollback::Processed refused = late.Process(FrameAt(1.25, {{0, 70.0}}));
  ASSERT_EQ(refused.size(), 1u);
  const UpdateReport& report = refused.front().report;
  EXPECT_TRUE(report.stale);
  ASSERT_EQ(report.measurements().size(), 1u);
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kStale);
  ASSERT_EQ(report.events.size(), 1u);
  EXPECT_EQ(report.events[0].kind, EventKind::kStale);
  EXPECT_EQ(
      report.events[0].text,
      "the frame at 1.250000 s is 0.750000 s older than the newest frame, which exceeds the window "
      "of 0.500000 s: the measurements of this frame are not used");
  ExpectSame(late.filter().state(), in_order.state());
  late.Process(FrameAt(1.75, {{0, 81.0}}));  // this frame is within the window
  EXPECT_FALSE(late.filter().state().values() == in_order.state().values());
}

// A Timestamp cannot represent the difference of the two timestamps.
TEST(Rollback, TimesFarApartAreBeyondEveryWindow) {
  const Problem problem = DepthFilter();
  Rollback late(Ekf(problem, {}, StreamsOf(problem)), 9.1e9);
  late.Process(FrameAt(9e9, {}));
  EXPECT_TRUE(late.Process(FrameAt(-9e9, {})).front().report.stale);
}

TEST(Rollback, PushIsProcessAndRefusesWhatAFilterDoes) {
  const Problem problem = DepthFilter();
  Rollback pushed(Ekf(problem, {}, StreamsOf(problem)), 1.0), processed(pushed.filter(), 1.0);
  for (const double t_s : {1.0, 2.0, 1.5}) {
    pushed.Push(TimestampFromSeconds(t_s), {{0, {80.0 + t_s}}});
    processed.Process(FrameAt(t_s, {{0, 80.0 + t_s}}));
  }
  ExpectSame(pushed.filter().state(), processed.filter().state());
  EXPECT_THROW(pushed.Push(TimestampFromSeconds(1.7), {{0, {1.0, 2.0}}}), Error);
  ExpectSame(pushed.filter().state(), processed.filter().state());
}

TEST(Rollback, AWindowThatIsNoneIsMisuse) {
  const Problem problem = DepthFilter();
  const Ekf ekf(problem, {}, StreamsOf(problem));
  EXPECT_THROW(Rollback(ekf, -1.0), ContractViolation);
  EXPECT_THROW(Rollback(ekf, std::nan("")), ContractViolation);
}

/// Estimator whose state is the sum of the measured values. The value 7 causes an exception.
class Sum : public Estimator {
 public:
  void Start(Timestamp) override {}
  const UpdateReport& Process(const Frame& frame) override {
    sum += frame.measurements[0].values[0];
    if (frame.measurements[0].values[0] == 7.0) throw Error(ExitCode::kBadData, "seven");
    return report_;
  }
  std::unique_ptr<Estimator> Clone() const override { return std::make_unique<Sum>(*this); }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return 0; }
  bool diverged() const override { return false; }
  bool failed() const override { return sum > 100.0; }

  double sum = 0.0;

 private:
  UpdateReport report_;
  State state_;
};

double SumOf(const std::unique_ptr<Estimator>& estimator) {
  return dynamic_cast<const Sum&>(*estimator).sum;
}

TEST(Snapshots, AnEstimatorThatThrowsLeavesThemAsTheyWere) {
  std::unique_ptr<Estimator> sum = std::make_unique<Sum>();
  Snapshots snapshots(*sum);
  snapshots.Replace(0, {FrameAt(0.0, {{0, 1.0}}), FrameAt(1.0, {{0, 2.0}})}, sum);
  EXPECT_EQ(SumOf(sum), 3.0);
  EXPECT_THROW(snapshots.Replace(1, {FrameAt(0.5, {{0, 7.0}}), FrameAt(1.0, {{0, 2.0}})}, sum),
               Error);
  EXPECT_EQ(SumOf(sum), 3.0);
  ASSERT_EQ(snapshots.frames().size(), 2u);
  EXPECT_EQ(SumOf(snapshots.frames()[1].snapshot), 3.0);
}

TEST(Snapshots, AFailedEstimatorTakesNoMoreFrames) {
  std::unique_ptr<Estimator> sum = std::make_unique<Sum>();
  Snapshots snapshots(*sum);
  snapshots.Replace(0, {FrameAt(0.0, {{0, 101.0}}), FrameAt(1.0, {{0, 2.0}})}, sum);
  EXPECT_EQ(SumOf(sum), 101.0);
  snapshots.Release();
  EXPECT_EQ(SumOf(snapshots.released().snapshot), 101.0);
  ASSERT_EQ(snapshots.frames().size(), 1u);
  EXPECT_TRUE(snapshots.frames()[0].snapshot->failed());
}

}  // namespace
}  // namespace alidade::testing
