// SPDX-License-Identifier: Apache-2.0
//
// Tests faults 36 and 37 of tests/faults/README.md: late frames and equal timestamps, frame by
// frame.
#include <algorithm>
#include <stdexcept>

#include "alidade/io/log.h"
#include "support/recording.h"

namespace alidade::testing {
namespace {

class FrameOrder : public ::testing::TestWithParam<OutOfSequence> {};

INSTANTIATE_TEST_SUITE_P(Policies, FrameOrder,
                         ::testing::Values(OutOfSequence::kBuffer, OutOfSequence::kRollback),
                         [](const auto& of) {
                           return of.param == OutOfSequence::kBuffer ? "buffer" : "rollback";
                         });

/// Returns FrameAt(t_s, values) as a frame without truth.
SourceFrame GivenAt(double t_s, const std::vector<std::pair<int, double>>& values) {
  return {FrameAt(t_s, values)};
}

/// A source with the given frames. Frame k is in line k + 2 of rows.csv. If `then_fails` is true,
/// the source throws after the last frame.
class Given : public SwingingTarget {
 public:
  explicit Given(std::vector<SourceFrame> frames, bool then_fails = false)
      : SwingingTarget(0), frames_(std::move(frames)), then_fails_(then_fails) {}
  bool Next(SourceFrame& frame) override {
    if (next_ == std::ssize(frames_) && then_fails_) throw Error(ExitCode::kBadData, "torn");
    if (next_ == std::ssize(frames_)) return false;
    frame = frames_[static_cast<std::size_t>(next_++)];
    return true;
  }
  const std::vector<StreamInfo>& streams() const override { return with_another_; }
  Place place() const override { return {"rows.csv", next_ + 1, 0}; }

 private:
  std::vector<StreamInfo> with_another_ = {{"disparity", 1}, {"inverse_scale", 1}, {"aside", 1}};
  std::vector<SourceFrame> frames_;
  int next_ = 0;
  bool then_fails_;
};

Experiment MakeGiven(std::vector<SourceFrame> frames, OutOfSequence order,
                     bool then_fails = false) {
  Experiment experiment = MakeExperiment();
  experiment.source = std::make_unique<Given>(std::move(frames), then_fails);
  experiment.out_of_sequence.policy = order;
  experiment.out_of_sequence.window = TimestampFromSeconds(0.1);
  return experiment;
}

TEST_P(FrameOrder, AFrameBeyondTheWindowIsDroppedWithAnEvent) {
  // A frame that is 0.1 s older than the newest frame is within the window. A frame that is another
  // nanosecond older is outside the window.
  SourceFrame beyond = GivenAt(0.2, {{0, 80.0}, {1, 1.0}});
  beyond.timestamp -= 1;
  Experiment experiment = MakeGiven(
      {GivenAt(0.1, {{1, 1.0}}), GivenAt(0.3, {{1, 1.0}}), beyond, GivenAt(0.2, {{1, 1.0}})},
      GetParam());
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.status, RunStatus::kOk) << result.reason;
  EXPECT_EQ(result.frames, 3);
  EXPECT_EQ(result.arrivals.out_of_sequence, 2);
  EXPECT_EQ(result.arrivals.dropped, 1);
  EXPECT_EQ(result.arrivals.longest_lag, 100'000'001);
  for (const EstimatorResult& one : result.estimators) {
    const auto event = std::ranges::find(one.events, EventKind::kOutOfSequence, &Event::kind);
    ASSERT_NE(event, one.events.end());
    EXPECT_EQ(event->timestamp, beyond.timestamp);
    EXPECT_EQ(event->text,
              "a frame of disparity, inverse_scale was dropped: it is 0.100000 s older than the "
              "newest frame, but the window is only 0.100000 s");
  }
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 3);
}

TEST_P(FrameOrder, AFrameBeforeTheFirstIsWhereTheRunStarts) {
  const SourceFrame first = GivenAt(0.0, {{1, 1.0}}), second = GivenAt(0.1, {{1, 1.1}});
  Experiment in_order = MakeGiven({first, second}, OutOfSequence::kReject);
  Experiment late = MakeGiven({second, first}, GetParam());
  alidade::Run(in_order, {});
  alidade::Run(late, {});
  EXPECT_EQ(late.estimators[0].estimator->state().values(),
            in_order.estimators[0].estimator->state().values());
}

TEST_P(FrameOrder, AStreamTwiceAtOneTimestampIsAnErrorThatNamesBothPlaces) {
  Experiment experiment =
      MakeGiven({GivenAt(0.0, {{1, 1.0}}), GivenAt(0.05, {{1, 1.0}}), GivenAt(0.1, {{1, 1.0}}),
                 GivenAt(0.05, {{0, 80.0}}), GivenAt(0.05, {{1, 1.0}})},
                GetParam());
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kBadData);
  EXPECT_EQ(
      result.reason,
      "rows.csv:6: stream 'inverse_scale' has two measurements at t = 0.050000 s; expected one "
      "measurement per timestamp; the first is in rows.csv:3");
  EXPECT_EQ(result.frames, 3);  // the frames before the error are kept
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 3);
}

TEST_P(FrameOrder, MergedMeasurementsHaveTheOrderOfTheSensors) {
  for (const bool swapped : {false, true}) {
    const TemporaryFolder folder;
    const std::vector<SourceFrame> frames = {GivenAt(0.0, {{0, 80.0}}), GivenAt(0.0, {{1, 1.0}})};
    Experiment experiment = MakeGiven({frames[swapped], frames[!swapped]}, GetParam());
    experiment.out_of_sequence.ranks = {1, 0};
    Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
    recorder.Finish(RunInto(recorder, experiment));
    EXPECT_EQ(Lines(folder / "out/measurements.csv"),
              (std::vector<std::string>{"t_s,stream,landmark,v0", "0.000000000,inverse_scale,,1",
                                        "0.000000000,disparity,,80"}));
    const std::string timing = Read(folder / "out/timing.json");
    EXPECT_NE(timing.find("\"merged\": 1"), std::string::npos) << timing;
  }
}

// In a frame of the source, the measurements may have another order than the sensors.
TEST_P(FrameOrder, MergedFramesOfSeveralMeasurementsToo) {
  for (const bool swapped : {false, true}) {
    const TemporaryFolder folder;
    const std::vector<SourceFrame> frames = {GivenAt(0.0, {{0, 80.0}, {1, 1.0}}),
                                             GivenAt(0.0, {{2, 5.0}})};
    Experiment experiment = MakeGiven({frames[swapped], frames[!swapped]}, GetParam());
    experiment.out_of_sequence.ranks = {2, 1, 0};
    Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
    recorder.Finish(RunInto(recorder, experiment));
    EXPECT_EQ(
        Lines(folder / "out/measurements.csv"),
        (std::vector<std::string>{"t_s,stream,landmark,v0", "0.000000000,aside,,5",
                                  "0.000000000,inverse_scale,,1", "0.000000000,disparity,,80"}))
        << swapped;
  }
}

// When frames are merged, each measurement keeps the line number of its own frame.
TEST_P(FrameOrder, AStreamTwiceInMergedFramesNamesTheFirstOfItsOwn) {
  Experiment experiment = MakeGiven(
      {GivenAt(0.0, {{0, 80.0}, {1, 1.0}}), GivenAt(0.0, {{2, 5.0}}), GivenAt(0.0, {{2, 5.0}})},
      GetParam());
  experiment.out_of_sequence.ranks = {2, 1, 0};
  EXPECT_EQ(alidade::Run(experiment, {}).reason,
            "rows.csv:4: stream 'aside' has two measurements at t = 0.000000 s; expected one "
            "measurement per timestamp; the first is in rows.csv:3");
}

TEST_P(FrameOrder, LandmarksOfOneStreamAreNotTheSameTwice) {
  SourceFrame one = GivenAt(0.0, {{1, 1.0}}), another = one;
  one.measurements[0].landmark = 1;
  another.measurements[0].landmark = 2;
  Experiment experiment = MakeGiven({one, another}, GetParam());
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.status, RunStatus::kOk) << result.reason;
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 2);
}

TEST_P(FrameOrder, TwoTruthsAtOneTimestampAreAnError) {
  SourceFrame one = GivenAt(0.0, {{1, 1.0}}), same = GivenAt(0.0, {{0, 80.0}}),
              other = GivenAt(0.0, {});
  one.truth = same.truth = {{0.3}};
  other.truth = {{0.31}};
  Experiment experiment = MakeGiven({one, same}, GetParam());
  EXPECT_EQ(alidade::Run(experiment, {}).status, RunStatus::kOk);
  experiment = MakeGiven({one, same, other}, GetParam());
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kBadData);
  EXPECT_EQ(result.reason,
            "rows.csv:4: truth 'depth' has two values at t = 0.000000 s; expected one value per "
            "timestamp");
}

TEST_P(FrameOrder, ARowThatIsRefusedForItsTruthIsNotUsedAtAll) {
  SourceFrame one = GivenAt(0.0, {{1, 1.0}}), refused = GivenAt(0.0, {{0, 80.0}});
  one.truth = {{0.3}};
  refused.truth = {{0.31}};
  Experiment experiment = MakeGiven({one, refused}, GetParam());
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kBadData);
  EXPECT_EQ(result.arrivals.merged, 0);
  EXPECT_EQ(result.frames, 1);
  EXPECT_EQ(result.estimators[0].counts,
            (std::map<std::string, std::int64_t>{{"accepted:inverse_scale", 1}}));
}

TEST_P(FrameOrder, BadDataKeepsTheFramesHeldBack) {
  Experiment experiment =
      MakeGiven({GivenAt(0.1, {{1, 1.0}}), GivenAt(0.05, {{1, 1.0}}), GivenAt(0.0, {{1, 1.0}})},
                GetParam(), true);
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kBadData);
  EXPECT_EQ(result.reason, "torn");
  EXPECT_EQ(result.frames, 3);
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 3);
}

TEST_P(FrameOrder, DivergenceUnderFailEndsTheRunAtTheFrameOfTheInOrderRun) {
  // Both sensors are undefined for a negative depth. They therefore reject this depth as out of
  // domain from the second frame on.
  const std::vector<SourceFrame> frames = {GivenAt(0.0, {}), GivenAt(0.05, {{0, 80.0}}),
                                           GivenAt(0.1, {{0, 80.0}}), GivenAt(0.15, {{0, 80.0}})};
  std::vector<Timestamp> ends;
  const auto run = [&ends](std::vector<SourceFrame> given, OutOfSequence order) {
    Experiment experiment = MakeGiven(std::move(given), order);
    EstimatorSpec& alone = experiment.estimators[1];
    alone.problem.priors[0].mean = {-0.2};
    alone.on_divergence = OnDivergence::kFail;
    alone.estimator =
        std::make_unique<Ekf>(alone.problem, EkfOptions{}, experiment.source->streams());
    const RunResult result = alidade::Run(experiment, {});
    for (const EstimatorSpec& one : experiment.estimators) {
      ends.push_back(one.estimator->timestamp());
    }
    return result;
  };
  const RunResult in_order = run(frames, OutOfSequence::kReject);
  ASSERT_EQ(in_order.code, ExitCode::kDiverged);
  EXPECT_EQ(in_order.frames, 2);
  const RunResult late = run({frames[2], frames[0], frames[3], frames[1]}, GetParam());
  EXPECT_EQ(late.reason, in_order.reason);
  EXPECT_EQ(late.frames, in_order.frames);
  for (std::size_t e = 0; e < 2; ++e) {
    EXPECT_EQ(late.estimators[e].diverged, in_order.estimators[e].diverged);
    EXPECT_EQ(late.estimators[e].counts, in_order.estimators[e].counts);
  }
  EXPECT_EQ(ends, std::vector<Timestamp>(4, frames[1].timestamp));
}

/// An ekf that fails at the frame with the timestamp `at`.
struct Mortal : Ekf {
  using Ekf::Ekf;
  const UpdateReport& Process(const Frame& frame) override {
    failed_ = failed_ || frame.timestamp == at;
    return Ekf::Process(frame);
  }
  std::unique_ptr<Estimator> Clone() const override { return std::make_unique<Mortal>(*this); }
  bool failed() const override { return failed_; }
  Timestamp at = kNoTimestamp;

 private:
  bool failed_ = false;
};

// The depth is negative, so the estimator diverges at the first frame. The estimator fails at the
// third frame.
TEST_P(FrameOrder, AStopLeavesTheEstimatorsAndTheLogAtTheLastFrameTaken) {
  std::vector<SourceFrame> frames;
  for (int k = 0; k < 8; ++k) frames.push_back(GivenAt(0.05 * k, {{0, 80.0 - k}, {1, 1.0}}));
  const auto run = [&frames](OutOfSequence order, std::vector<std::string>& log) {
    Experiment experiment = MakeGiven(frames, order);
    EstimatorSpec& named = experiment.estimators[1];
    named.problem.priors[0].mean = {-0.2};
    auto mortal =
        std::make_unique<Mortal>(named.problem, EkfOptions{}, experiment.source->streams());
    mortal->at = frames[2].timestamp;
    named.estimator = std::move(mortal);
    const LogSubscription subscription(
        LogLevel::kWarning, [&](LogLevel, std::string_view text) { log.emplace_back(text); });
    int left = 2;
    RunOptions options;
    options.stop = [&left] { return --left == 0; };
    const RunResult result = alidade::Run(experiment, options);
    EXPECT_EQ(result.status, RunStatus::kStopped);
    EXPECT_EQ(result.frames, 2);
    return experiment;
  };
  std::vector<std::string> log, late_log;
  const Experiment in_order = run(OutOfSequence::kReject, log);
  const Experiment late = run(GetParam(), late_log);
  ASSERT_EQ(log.size(), 1u);
  EXPECT_NE(log[0].find("not defined at target.depth = -0.2"), std::string::npos) << log[0];
  EXPECT_EQ(late_log, log);
  for (std::size_t e = 0; e < 2; ++e) {
    const Estimator &one = *late.estimators[e].estimator,
                    &other = *in_order.estimators[e].estimator;
    EXPECT_FALSE(one.failed());
    EXPECT_EQ(one.timestamp(), frames[1].timestamp);
    EXPECT_EQ(one.state().values(), other.state().values());
    EXPECT_EQ(one.state().covariance().Dense(), other.state().covariance().Dense());
  }
}

TEST(Sort, WithoutAWindowTakesTheWholeRun) {
  std::vector<SourceFrame> frames;
  for (int k = 0; k < 50; ++k) frames.push_back(GivenAt(100.0 - k, {{1, 1.0}}));
  Experiment experiment = MakeGiven(frames, OutOfSequence::kBuffer);
  experiment.out_of_sequence.window.reset();
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.frames, 50);
  EXPECT_EQ(result.arrivals.out_of_sequence, 49);
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 50);
}

/// An ekf that records the timestamps of its frames. All copies share the same list.
struct Watching : Ekf {
  using Ekf::Ekf;
  const UpdateReport& Process(const Frame& frame) override {
    timestamps->push_back(frame.timestamp);
    return Ekf::Process(frame);
  }
  std::unique_ptr<Estimator> Clone() const override { return std::make_unique<Watching>(*this); }
  std::shared_ptr<std::vector<Timestamp>> timestamps = std::make_shared<std::vector<Timestamp>>();
};

TEST(Rollback, TakesAFrameAtOnceAndTheLaterOnesAgain) {
  Experiment experiment = MakeGiven({GivenAt(0.0, {{1, 1.0}}), GivenAt(0.05, {{1, 1.0}}),
                                     GivenAt(0.1, {{1, 1.0}}), GivenAt(0.02, {{1, 1.0}})},
                                    OutOfSequence::kRollback);
  EstimatorSpec& named = experiment.estimators[0];
  auto watching =
      std::make_unique<Watching>(named.problem, EkfOptions{}, experiment.source->streams());
  const auto seen = watching->timestamps;
  named.estimator = std::move(watching);
  alidade::Run(experiment, {});
  const Timestamp ms = 1'000'000;
  EXPECT_EQ(*seen, (std::vector<Timestamp>{0, 50 * ms, 100 * ms, 20 * ms, 50 * ms, 100 * ms}));
}

/// An ekf that throws once, at the frame with the timestamp `at`.
struct Throwing : Ekf {
  using Ekf::Ekf;
  const UpdateReport& Process(const Frame& frame) override {
    if (frame.timestamp == at) {
      at = kNoTimestamp;
      throw std::logic_error("an invariant");
    }
    return Ekf::Process(frame);
  }
  Timestamp at = kNoTimestamp;
};

TEST(Rollback, AnEstimatorThatThrowsEndsTheRunAfterTheFramesBefore) {
  // All frames are within the window, so no frame is released before the third frame is processed.
  Experiment experiment = MakeGiven({GivenAt(0.0, {{1, 1.0}}), GivenAt(0.02, {{1, 1.0}}),
                                     GivenAt(0.04, {{1, 1.0}}), GivenAt(0.06, {{1, 1.0}})},
                                    OutOfSequence::kRollback);
  EstimatorSpec& named = experiment.estimators[1];
  auto throwing =
      std::make_unique<Throwing>(named.problem, EkfOptions{}, experiment.source->streams());
  throwing->at = TimestampFromSeconds(0.04);
  named.estimator = std::move(throwing);
  const RunResult result = alidade::Run(experiment, {});
  EXPECT_EQ(result.code, ExitCode::kInternal);
  EXPECT_EQ(result.reason, "internal: an invariant");
  EXPECT_EQ(result.frames, 2);
  EXPECT_EQ(result.estimators[0].counts.at("accepted:inverse_scale"), 2);
  for (const EstimatorSpec& one :
       // Checks both estimators, because the first one had already processed the third frame.
       experiment.estimators) {
    EXPECT_EQ(one.estimator->timestamp(), TimestampFromSeconds(0.02));
  }
}

/// An estimator that does not implement Clone, which Rollback needs.
class Forward : public Estimator {
 public:
  explicit Forward(const Problem& problem) : state_(problem.InitialState()) {}
  void Start(Timestamp) override {}
  const UpdateReport& Process(const Frame&) override { return report_; }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return kNoTimestamp; }
  bool diverged() const override { return false; }
  bool failed() const override { return false; }

 private:
  State state_;
  UpdateReport report_;
};

TEST(Rollback, IsNotForAnEstimatorThatCannotGoBack) {
  Experiment experiment = MakeGiven({GivenAt(0.0, {})}, OutOfSequence::kRollback);
  experiment.estimators[0].estimator = std::make_unique<Forward>(experiment.estimators[0].problem);
  EXPECT_EQ(alidade::Run(experiment, {}).code, ExitCode::kInternal);
}

}  // namespace
}  // namespace alidade::testing
