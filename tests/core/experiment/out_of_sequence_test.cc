// SPDX-License-Identifier: Apache-2.0
//
// Tests faults 36 and 37 of tests/faults/README.md: frames that are not in the order of their
// timestamps.
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "alidade/check/explain.h"
#include "alidade/replay/replay.h"
#include "support/recording.h"

namespace alidade::testing {
namespace {

constexpr double kWindow_s = 0.2;  // equals six frame intervals of the simulator

/// Config with all types of filter, and with a smoother, which processes the frames only after the
/// last frame has arrived.
constexpr const char* kFilters = R"(alidade: 1
state:
  target: {model: constant_velocity, blocks: {position: depth, velocity: depth_rate},
           noise: {kind: discrete, acceleration: 1.0},
           initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {mean: 0, sigma: 0.5}}}
  template: {model: constant, blocks: {value: inverse_distance},
             initial: {inverse_distance: {mean: 3.3, sigma: 0.5}}}
sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 400, baseline_m: 0.065, sigma_px: 1.0}
  scale: {model: scale_2d, stream: inverse_scale,
          roles: {depth: target.depth, inverse_distance: template.inverse_distance},
          template_px: 300, sigma_px: 1.0}
source: {type: depth_target, seed: 1}
estimators:
  ekf: {type: ekf, gate: 0.999}
  first: {type: ekf, jacobian: first_estimate, fuse: per_measurement}
  iekf: {type: iekf, gate: 0.999}
  ukf: {type: ukf, alpha: 1, gate: 0.9,
        overrides: {state: {target: {initial: {depth: {sigma: 0.2}}}}}}  # guarded at first
  root: {type: square_root_ekf}
  rts: {type: rts}
evaluate:
  segments: {seeing: {with: stereo}, blind: {without: stereo}}
)";

/// Config whose blocks are initialised from their first measurement. The gate is so narrow that
/// sensors need rejection recovery. The results therefore depend on more than the state of the
/// filter.
constexpr const char* kEventful = R"(alidade: 1
state:
  target: {model: constant_velocity, blocks: {position: depth, velocity: depth_rate},
           noise: {kind: discrete, acceleration: 0.1},
           initial: {depth: {from_measurement: stereo}, depth_rate: {mean: 0, sigma: 0.5}}}
  template: {model: constant, blocks: {value: inverse_distance},
             initial: {inverse_distance: {from_measurement: scale}}}
sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 400, baseline_m: 0.065, sigma_px: 0.5}
  scale: {model: scale_2d, stream: inverse_scale,
          roles: {depth: target.depth, inverse_distance: template.inverse_distance},
          template_px: 300, sigma_px: 1.0}
source: {type: depth_target, seed: 3}
estimators:
  reset: {type: ekf, gate: 0.5, rejection_recovery: {after: 3}, jacobian: first_estimate}
  inflate: {type: ekf, gate: 0.5, rejection_recovery: {after: 3, action: inflate}}
)";

/// A source whose frames are delayed by a random time of at most `most_s`. The first frame is
/// delayed by exactly `most_s`. If `split` is true, each measurement and the truth arrive in
/// separate frames.
class Delayed : public Source {
 public:
  Delayed(std::unique_ptr<Source> source, double most_s, bool split) : source_(std::move(source)) {
    std::mt19937_64 random(7);
    std::multimap<Timestamp, SourceFrame> arrivals;  // equal times keep the order of insertion
    const auto add = [&](SourceFrame frame) {
      const auto most = static_cast<std::uint64_t>(TimestampFromSeconds(most_s));
      const auto delay = static_cast<Timestamp>(arrivals.empty() ? most : random() % (most + 1));
      const Timestamp at = frame.timestamp + delay;
      arrivals.emplace(at, std::move(frame));
    };
    for (SourceFrame frame; source_->Next(frame);) {
      if (!split) {
        add(frame);
        continue;
      }
      for (const Measurement& m : frame.measurements) add({{frame.timestamp, {m}}});
      add({{frame.timestamp, {}}, frame.truth});
    }
    for (auto& [at, frame] : arrivals) frames_.push_back(std::move(frame));
  }
  const std::vector<StreamInfo>& streams() const override { return source_->streams(); }
  const std::vector<StreamInfo>& truths() const override { return source_->truths(); }
  bool Next(SourceFrame& frame) override {
    if (next_ == frames_.size()) return false;
    frame = frames_[next_++];
    return true;
  }

 private:
  std::unique_ptr<Source> source_;
  std::vector<SourceFrame> frames_;
  std::size_t next_ = 0;
};

/// Runs the experiment of the config with delayed frames, and records the run in `folder`.
RunResult RecordDelayed(const std::string& text, const fs::path& folder, OutOfSequence order,
                        double most_s, bool split = false) {
  const Config config = Config::FromText(text, "order.yaml");
  Experiment experiment = BuildExperiment(config, Host());
  experiment.source = std::make_unique<Delayed>(std::move(experiment.source), most_s, split);
  experiment.out_of_sequence.policy = order;
  experiment.out_of_sequence.window = TimestampFromSeconds(kWindow_s);
  Recorder recorder(OptionsFor(folder), config);
  RunResult result = RunInto(recorder, experiment);
  recorder.Finish(result);
  return result;
}

void ExpectSameBytes(const fs::path& one, const fs::path& another) {
  const std::vector<std::string> files = FilesIn(one);
  EXPECT_GT(files.size(), 10u);
  EXPECT_EQ(files, FilesIn(another));
  for (const std::string& file : files) {
    if (internal::HasWallClock(file)) continue;
    EXPECT_TRUE(Read(one / file) == Read(another / file)) << another / file;
  }
}

class Reordered : public ::testing::TestWithParam<OutOfSequence> {
 protected:
  const TemporaryFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Policies, Reordered,
                         ::testing::Values(OutOfSequence::kBuffer, OutOfSequence::kRollback),
                         [](const auto& of) {
                           return of.param == OutOfSequence::kBuffer ? "buffer" : "rollback";
                         });

TEST_P(Reordered, LateFramesGiveTheBytesOfTheInOrderRun) {
  for (const char* config : {kFilters, kEventful}) {
    const fs::path here = folder_ / (config == kFilters ? "filters" : "eventful");
    // Without delays the policy has no effect: the estimators receive the frames directly.
    const RunResult in_order =
        RecordDelayed(config, here / "in_order", OutOfSequence::kReject, 0.0);
    EXPECT_EQ(in_order.status, RunStatus::kOk);
    EXPECT_EQ(in_order.arrivals.out_of_sequence, 0);
    if (config == kEventful) {
      for (const EstimatorResult& one : in_order.estimators) {
        EXPECT_GT(std::ranges::count(one.events, EventKind::kRejectionRecovery, &Event::kind), 3)
            << one.name;
        EXPECT_EQ(one.counts.at("initialised:stereo"), 1) << one.name;
        EXPECT_EQ(one.counts.at("initialised:scale"), 1) << one.name;
      }
    }
    const RunResult late = RecordDelayed(config, here / "late", GetParam(), kWindow_s);
    EXPECT_GT(late.arrivals.out_of_sequence, 50);
    EXPECT_LE(late.arrivals.longest_lag, TimestampFromSeconds(kWindow_s));
    EXPECT_EQ(late.arrivals.dropped, 0);
    ExpectSameBytes(here / "in_order", here / "late");
    // If the frames are not reordered, the counts are different.
    const RunResult rejected =
        RecordDelayed(config, here / "rejected", OutOfSequence::kReject, kWindow_s);
    EXPECT_NE(rejected.estimators[0].counts, in_order.estimators[0].counts);
  }
}

TEST_P(Reordered, MeasurementsThatComeOneByOneAreMergedIntoTheirTimestamp) {
  const RunResult whole = RecordDelayed(kFilters, folder_ / "whole", OutOfSequence::kReject, 0.0);
  const RunResult in_order = RecordDelayed(kFilters, folder_ / "in_order", GetParam(), 0.0, true);
  const RunResult late = RecordDelayed(kFilters, folder_ / "late", GetParam(), kWindow_s, true);
  EXPECT_GT(in_order.arrivals.merged, whole.frames);
  EXPECT_EQ(in_order.arrivals.merged, late.arrivals.merged);
  EXPECT_EQ(late.frames, whole.frames);
  ExpectSameBytes(folder_ / "in_order", folder_ / "late");
  for (const EstimatorResult& one : whole.estimators) {
    for (const char* file : {"estimates.csv", "innovations.csv", "gains.csv"}) {
      EXPECT_TRUE(Read(folder_ / "whole" / one.name / file) ==
                  Read(folder_ / "late" / one.name / file))
          << one.name << ' ' << file;
    }
  }
  EXPECT_TRUE(Read(folder_ / "whole/truth.csv") == Read(folder_ / "late/truth.csv"));
}

/// Appends `time` to kFilters. Returns the message with which BuildExperiment rejects this config.
std::string Refused(const std::string& time) {
  std::string text;
  const Config config = Config::FromText(std::string(kFilters) + time + '\n', "order.yaml");
  EXPECT_EQ(CodeOf([&] { BuildExperiment(config, Host()); }, &text), 78) << time;
  return text;
}

TEST(OutOfSequencePolicy, IsReadStrictly) {
  const Config config = Config::FromText(
      std::string(kFilters) + "out_of_sequence: {policy: rollback, window_s: 0.25}\n",
      "order.yaml");
  const Experiment experiment = BuildExperiment(config, Host());
  const OutOfSequencePolicy& policy = experiment.out_of_sequence;
  EXPECT_EQ(policy.policy, OutOfSequence::kRollback);
  EXPECT_EQ(policy.window, 250'000'000);
  EXPECT_NE(Explain(config, experiment)
                .find("out-of-sequence frames: rollback: the estimators return to an earlier "
                      "state and process all frames in order; a frame may be "
                      "up to 0.25 s older than the newest frame"),
            std::string::npos);
  std::map<std::string, int> ranks;
  for (std::size_t s = 0; s < policy.ranks.size(); ++s) {
    ranks[experiment.source->streams()[s].name] = policy.ranks[s];
  }
  EXPECT_EQ(ranks.size(), experiment.source->streams().size());
  EXPECT_EQ(ranks["disparity"], 0);
  EXPECT_EQ(ranks["inverse_scale"], 1);
  EXPECT_EQ(ranks["disparity_all"], 2);  // no sensor uses this stream
  EXPECT_EQ(Refused("out_of_sequence: {policy: rollback}"),
            "order.yaml:25:27 out_of_sequence.policy: 'policy: rollback' needs the key 'window_s'; "
            "expected 'window_s', the largest lag of an out-of-sequence frame in seconds");
  EXPECT_EQ(Refused("out_of_sequence: {policy: reject, window_s: 1}"),
            "order.yaml:25:45 out_of_sequence.window_s: this key has no effect, because 'policy: "
            "reject' does not buffer frames; expected 'policy: buffer' or 'policy: rollback'");
  EXPECT_NE(Refused("out_of_sequence: {policy: buffered}").find("did you mean 'buffer'?"),
            std::string::npos);
  EXPECT_NE(Refused("out_of_sequence: {policy: buffer, window_s: -1}")
                .find("25:45 out_of_sequence.window_s"),
            std::string::npos);
  EXPECT_NE(Refused("out_of_sequence: {window_s: 1}").find("policy"), std::string::npos);
}

TEST(Sort, LetsATableHaveItsRowsInAnyOrder) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& rows, const std::string& time) {
    std::ofstream(folder / "rows.csv") << "t_s,d,s\n" << rows;
    std::string text = kFilters;
    const std::string source = "{type: depth_target, seed: 1}";
    text.replace(text.find(source), source.size(),
                 "{type: tables, path: '" + (folder / "rows.csv").string() +
                     "', streams: {disparity: d, inverse_scale: s}}");
    const Config config = Config::FromText(text + time, "order.yaml");
    Experiment experiment = BuildExperiment(config, Host());
    return alidade::Run(experiment, {});
  };
  const std::string buffer = "out_of_sequence: {policy: buffer}\n";
  const RunResult whole = run("0,80,1\n0.1,81,1.01\n0.2,82,1.02\n", "");
  const RunResult mixed = run("0.2,82,\n0.1,81,1.01\n0,80,1\n0.2,,1.02\n", buffer);
  ASSERT_EQ(whole.status, RunStatus::kOk) << whole.reason;
  ASSERT_EQ(mixed.status, RunStatus::kOk) << mixed.reason;
  EXPECT_EQ(mixed.frames, 3);
  for (std::size_t e = 0; e < whole.estimators.size(); ++e) {
    EXPECT_EQ(mixed.estimators[e].metrics, whole.estimators[e].metrics);
  }
  EXPECT_EQ(run("0.2,82,\n0.1,81,1\n0.2,83,1\n", buffer).reason,
            (folder / "rows.csv").string() +
                ":4: stream 'disparity' has two measurements at t = 0.200000 s; expected one "
                "measurement per timestamp; the first is in " +
                (folder / "rows.csv").string() + ":2");
}

}  // namespace
}  // namespace alidade::testing
