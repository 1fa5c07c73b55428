// SPDX-License-Identifier: Apache-2.0
//
// An estimator that uses what a filter before it accepted.
#include "support/recording.h"

namespace alidade::testing {
namespace {

constexpr int kFrames = 80;

/// A target as SwingingTarget has it, whose scale is off by 0.5 on every eleventh frame, from the
/// fifth on; or without those measurements.
class WithOutliers : public SwingingTarget {
 public:
  /// `late`: each third frame comes after the one behind it.
  WithOutliers(bool outliers, bool late) : SwingingTarget(0) {
    SwingingTarget target(kFrames);
    Frame frame;
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
  bool Next(Frame& frame) override {
    if (next_ == frames_.size()) return false;
    frame = frames_[next_++];
    return true;
  }

 private:
  std::vector<Frame> frames_;
  std::size_t next_ = 0;
};

NamedEstimator MakeEkf(const std::string& name, double gate) {
  NamedEstimator named;
  named.name = name;
  named.type = "ekf";
  named.system = DepthFilter();
  EkfOptions options;
  options.gate = gate;
  named.estimator = std::make_unique<Ekf>(named.system, options, StreamsOf(named.system));
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

/// The state of an ekf without a gate over data without outliers.
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
  // 5, 16, ..., 71
  EXPECT_EQ(run.estimators[0].counts.at("gated:inverse_scale"), 7);
  EXPECT_EQ(run.estimators[0].counts.count("gated:disparity"), 0u);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:inverse_scale"), kFrames - 7);
  EXPECT_EQ(run.estimators[1].counts.count("gated:inverse_scale"), 0u);
  EXPECT_EQ(experiment.estimators[1].estimator->state().values(), Clean());
}

TEST(AcceptedBy, HoldsWhereTheEstimatorsGoBackForLateFrames) {
  Experiment experiment = MakeFiltered(true);
  experiment.time.order = TimeOrder::kRewind;
  experiment.time.window = StampFromSeconds(0.2);
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  EXPECT_GT(run.arrivals.late, 20);
  EXPECT_EQ(run.estimators[0].counts.at("gated:inverse_scale"), 7);
  EXPECT_EQ(experiment.estimators[1].estimator->state().values(), Clean());
}

/// Accepts what comes, once.
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

// The frame at which the filter ended still counts: it accepted what came.
TEST(AcceptedBy, AFilterThatEndedAcceptsNothingMore) {
  Experiment experiment = MakeFiltered(false);
  NamedEstimator& filter = experiment.estimators[0];
  filter.estimator = std::make_unique<Once>(filter.system, EkfOptions{}, StreamsOf(filter.system));
  const RunResult run = alidade::Run(experiment, {});
  EXPECT_EQ(run.frames, kFrames);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:inverse_scale"), 1);
  EXPECT_EQ(run.estimators[1].counts.at("accepted:disparity"), 1);
}

TEST(AcceptedBy, ASensorOfWhichTheFilterTookNothingIsNamed) {
  Experiment experiment = MakeFiltered(false);
  NamedEstimator& filter = experiment.estimators[0];
  EkfOptions options;
  options.gate = 1e-9;
  options.lockout = Lockout::kNone;
  filter.estimator = std::make_unique<Ekf>(filter.system, options, StreamsOf(filter.system));
  const RunResult run = alidade::Run(experiment, {});
  const auto event = std::ranges::find(run.estimators[1].events, "unused", &Event::kind);
  ASSERT_NE(event, run.estimators[1].events.end());
  EXPECT_EQ(event->text,
            "sensor 'disparity': stream 'disparity' had no measurement that gated accepted");
}

}  // namespace
}  // namespace alidade::testing
