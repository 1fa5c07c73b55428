// SPDX-License-Identifier: Apache-2.0
//
// Tests an estimator that uses only the measurements that an earlier filter accepted.
#include "support/driven.h"
#include "support/landmark_models.h"
#include "support/recording.h"

namespace alidade::testing {
namespace {

constexpr int kFrames = 80;

/// A SwingingTarget whose scale measurement has an error of 0.5 in frames 5, 16, 27 and so on. If
/// `outliers` is false, these measurements are missing.
class WithOutliers : public SwingingTarget {
 public:
  /// If `late` is true, frames 3 i and 3 i + 1 are swapped, so every third frame is out of
  /// sequence.
  WithOutliers(bool outliers, bool late) : SwingingTarget(0) {
    SwingingTarget target(kFrames);
    SourceFrame frame;
    for (int k = 0; target.Next(frame); ++k) {
      Measurement& scale = frame.measurements[0];
      if (k % 11 == 5 && outliers) scale.values[0] += 0.5;
      if (k % 11 == 5 && !outliers) frame.measurements.erase(frame.measurements.begin());
      frames_.push_back(frame);
    }
    for (std::size_t k = 0; k + 1 < frames_.size() && late; k += 3) {
      std::swap(frames_[k], frames_[k + 1]);
    }
  }
  bool Next(SourceFrame& frame) override {
    if (next_ == frames_.size()) return false;
    frame = frames_[next_++];
    return true;
  }

 private:
  std::vector<SourceFrame> frames_;
  std::size_t next_ = 0;
};

EstimatorSpec MakeEkf(const std::string& name, double gate) {
  EstimatorSpec named;
  named.name = name;
  named.type = "ekf";
  named.problem = DepthFilter();
  EkfOptions options;
  options.gate = gate;
  named.estimator = std::make_unique<Ekf>(named.problem, options, StreamsOf(named.problem));
  return named;
}

Experiment MakeFiltered(bool late) {
  Experiment experiment;
  experiment.source = std::make_unique<WithOutliers>(true, late);
  experiment.estimators.push_back(MakeEkf("gated", 0.999));
  experiment.estimators.push_back(MakeEkf("follower", 1.0));
  experiment.estimators[1].accepted_by = 0;
  return experiment;
}

/// Returns the state of an ekf without a gate after the data without outliers.
std::vector<double> Clean() {
  Experiment clean;
  clean.source = std::make_unique<WithOutliers>(false, false);
  clean.estimators.push_back(MakeEkf("ekf", 1.0));
  EXPECT_EQ(alidade::Run(clean, {}).status, RunStatus::kOk);
  return clean.estimators[0].estimator->state().values();
}

TEST(AcceptedBy, LeavesOutWhatTheFilterGated) {
  Experiment experiment = MakeFiltered(false);
  const RunResult run = alidade::Run(experiment, {});
  // The outliers are in frames 5, 16, ..., 71.
  EXPECT_EQ(run.estimators[0].counts.at("gated:inverse_scale"), 7);
  EXPECT_EQ(run.estimators[0].counts.count("gated:disparity"), 0u);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:inverse_scale"), kFrames - 7);
  EXPECT_EQ(run.estimators[1].counts.count("gated:inverse_scale"), 0u);
  EXPECT_EQ(experiment.estimators[1].estimator->state().values(), Clean());
}

TEST(AcceptedBy, HoldsWhereTheEstimatorsGoBackForLateFrames) {
  Experiment experiment = MakeFiltered(true);
  experiment.out_of_sequence.policy = OutOfSequence::kRollback;
  experiment.out_of_sequence.window = TimestampFromSeconds(0.2);
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_GT(run.arrivals.out_of_sequence, 20);
  EXPECT_EQ(run.estimators[0].counts.at("gated:inverse_scale"), 7);
  EXPECT_EQ(experiment.estimators[1].estimator->state().values(), Clean());
}

/// A source with the given frames and streams.
class GivenFrames : public Source {
 public:
  GivenFrames(std::vector<StreamInfo> streams, std::vector<Frame> frames)
      : streams_(std::move(streams)), frames_(std::move(frames)) {}
  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(SourceFrame& frame) override {
    if (next_ == frames_.size()) return false;
    frame = {frames_[next_++]};
    return true;
  }

 private:
  std::vector<StreamInfo> streams_, truths_;
  std::vector<Frame> frames_;
  std::size_t next_ = 0;
};

/// Builds a chain of three ekf. The first ekf has a gate. The second and the third use the
/// measurements that the previous ekf accepted.
Experiment MakeChain(const Problem& problem, std::vector<StreamInfo> streams,
                     std::vector<Frame> frames) {
  Experiment experiment;
  for (int i = 0; i < 3; ++i) {
    EstimatorSpec& named = experiment.estimators.emplace_back();
    named.name = "ekf" + std::to_string(i);
    named.problem = problem;
    EkfOptions options;
    if (i == 0) options.gate = 0.999;
    named.estimator = std::make_unique<Ekf>(problem, options, streams);
    named.accepted_by = i - 1;
  }
  experiment.source = std::make_unique<GivenFrames>(std::move(streams), std::move(frames));
  return experiment;
}

// No sensor uses the odometry stream, so all its values are passed on, even those of a frame whose
// fix is gated.
TEST(AcceptedBy, PassesOnTheControlInputs) {
  Problem problem;
  AddMotion(problem, "car", MakeMotion(Driven(0.2), "driven"), {{"position", 1.0, 0.5}});
  problem.motions[0].input.stream = "odometry";
  AddSensor(problem, "fix", LinearSensor(1.0, 0.3), {"car.position"});
  const std::vector<Frame> frames = {FrameAt(0.0, {{0, 1.5}, {1, 2.0}}),
                                     FrameAt(1.0, {{0, 50.0}, {1, -1.0}}), FrameAt(2.0, {{1, 0.5}}),
                                     FrameAt(3.0, {{0, 2.6}})};
  Experiment experiment = MakeChain(problem, {{"fix", 1}, {"odometry", 1}}, frames);
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.estimators[0].counts.at("gated:fix"), 1);
  for (std::size_t e = 0; e < 3; ++e) {
    EXPECT_EQ(run.estimators[e].counts.at("inputs:car"), 3) << e;
    EXPECT_EQ(run.estimators[e].counts.at("accepted:fix"), 2) << e;
    EXPECT_TRUE(run.estimators[e].events.empty()) << e;
    EXPECT_EQ(experiment.estimators[e].estimator->state().values(),
              experiment.estimators[0].estimator->state().values())
        << e;
  }
}

/// Builds a chain for two landmarks in front of a camera at rest. In the second frame the pixel of
/// the first landmark has an error of 0.5.
Experiment MakeChainOfMaps() {
  const Problem problem = MapSystem(InverseDepthPixels(0.001), WithPrior(), 0.01);
  return MakeChain(problem, {{"tracks", 2}},
                   {FrameOf(0.0, {{0, {0.1, 0.1}}, {1, {-0.1, 0.1}}}),
                    FrameOf(0.1, {{0, {0.6, 0.1}}, {1, {-0.1, 0.1}}}),
                    FrameOf(0.2, {{0, {0.1, 0.1}}, {1, {-0.1, 0.1}}})});
}

// The stream has several measurements in each frame. Some of them initialise a landmark, and one is
// gated.
TEST(AcceptedBy, MayFollowAFollower) {
  for (const OutOfSequence order : {OutOfSequence::kReject, OutOfSequence::kRollback}) {
    Experiment experiment = MakeChainOfMaps();
    if (order == OutOfSequence::kRollback)
      experiment.out_of_sequence.window = TimestampFromSeconds(1.0);
    experiment.out_of_sequence.policy = order;
    const RunResult run = alidade::Run(experiment, {});
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
    EXPECT_EQ(run.estimators[0].counts.at("gated:tracks"), 1);
    for (std::size_t e = 0; e < 3; ++e) {
      EXPECT_EQ(run.estimators[e].counts.at("initialised:tracks"), 2) << e;
      EXPECT_EQ(run.estimators[e].counts.at("accepted:tracks"), 3) << e;
      EXPECT_EQ(run.estimators[e].counts.count("gated:tracks"), e == 0 ? 1u : 0u) << e;
    }
    EXPECT_EQ(experiment.estimators[2].estimator->state().values(),
              experiment.estimators[1].estimator->state().values());
  }
}

/// An ekf that accepts the measurements of its first frame and then ends.
struct Once : Ekf {
  using Ekf::Ekf;
  const UpdateReport& Process(const Frame& frame) override {
    const UpdateReport& report = Ekf::Process(frame);
    gone_ = true;
    return report;
  }
  bool failed() const override { return gone_; }

 private:
  bool gone_ = false;
};

// The measurements of the frame at which the filter ends are still used, because the filter
// accepted them.
TEST(AcceptedBy, AFilterThatEndedAcceptsNothingMore) {
  Experiment experiment = MakeFiltered(false);
  EstimatorSpec& filter = experiment.estimators[0];
  filter.estimator =
      std::make_unique<Once>(filter.problem, EkfOptions{}, StreamsOf(filter.problem));
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.frames, kFrames);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:inverse_scale"), 1);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:disparity"), 1);
}

TEST(AcceptedBy, ASensorOfWhichTheFilterTookNothingIsNamed) {
  Experiment experiment = MakeFiltered(false);
  EstimatorSpec& filter = experiment.estimators[0];
  EkfOptions options;
  options.gate = 1e-9;
  options.rejection_recovery = RejectionRecovery::kNone;
  filter.estimator = std::make_unique<Ekf>(filter.problem, options, StreamsOf(filter.problem));
  const RunResult run = alidade::Run(experiment, {});
  const auto event = std::ranges::find(run.estimators[1].events, EventKind::kUnused, &Event::kind);
  ASSERT_NE(event, run.estimators[1].events.end());
  EXPECT_EQ(event->text,
            "sensor 'disparity': stream 'disparity' had no measurement that 'gated' accepted");
}

}  // namespace
}  // namespace alidade::testing
