// SPDX-License-Identifier: Apache-2.0
//
// Tests comparisons with the batch estimator.
#include <Eigen/LU>
#include <cmath>

#include "alidade/compare/compare.h"
#include "alidade/estimation/rts.h"
#include "batch_fixture.h"

namespace alidade {
namespace {

using testing::LinearSystem;
using testing::MakeBatch;
using testing::Shipped;

/// A source that measures a point at cos t. Every fourth frame has no measurement. Measurements
/// have an oscillating error. If `with_outlier` is true, one measurement is an outlier.
class Swing : public Source {
 public:
  explicit Swing(bool with_outlier = false) : with_outlier_(with_outlier) {}
  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(SourceFrame& frame) override {
    if (next_ == kFrames) return false;
    const double t_s = 0.05 * next_, wobble = 0.3 * std::sin(37.0 * next_);
    const double z = 2.0 * std::cos(t_s) + wobble + (with_outlier_ && next_ == 9 ? 50.0 : 0.0);
    frame = {next_ % 4 == 3 ? testing::FrameAt(t_s, {}) : testing::FrameAt(t_s, {{0, z}}),
             {{std::cos(t_s)}}};
    ++next_;
    return true;
  }

 private:
  static constexpr int kFrames = 30;
  std::vector<StreamInfo> streams_ = testing::StreamsOf(LinearSystem());
  std::vector<StreamInfo> truths_ = {{"p.x", 1}};
  bool with_outlier_;
  int next_ = 0;
};

void Add(Experiment& experiment, const std::string& name, EstimatorKind kind,
         std::unique_ptr<Estimator> estimator, int accepted_by = -1) {
  EstimatorSpec& named = experiment.estimators.emplace_back();
  named.name = name;
  named.type = name;
  named.kind = kind;
  named.problem = LinearSystem();
  named.estimator = std::move(estimator);
  named.accepted_by = accepted_by;
}

/// Returns a filter and all estimators that its error decomposition needs.
Experiment MakeLinear(bool with_outlier) {
  const Problem problem = LinearSystem();
  EkfOptions options;
  options.gate = 0.9999;
  Experiment experiment;
  experiment.source = std::make_unique<Swing>(with_outlier);
  const std::vector<StreamInfo>& streams = experiment.source->streams();
  Add(experiment, "ekf", EstimatorKind::kFilter, std::make_unique<Ekf>(problem, options, streams));
  Add(experiment, "rts", EstimatorKind::kSmoother,
      std::make_unique<RtsSmoother>(problem, options, streams));
  Add(experiment, "full_information", EstimatorKind::kBatch,
      MakeBatch(problem, "mode: filtering\n"), 0);
  Add(experiment, "accepted", EstimatorKind::kBatch, MakeBatch(problem), 0);
  Add(experiment, "batch", EstimatorKind::kBatch, MakeBatch(problem));
  return experiment;
}

struct Compared {
  RunResult run;
  Comparison comparison;
};

Compared CompareLinear(bool with_outlier, const CompareOptions& options = {},
                       EstimatorKind smoother = EstimatorKind::kSmoother) {
  Experiment experiment = MakeLinear(with_outlier);
  experiment.estimators[1].kind = smoother;
  RunComparer comparer(experiment);
  RunOptions observed;
  observed.observers.push_back(&comparer);
  RunResult run = Run(experiment, observed);
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  Comparison comparison = comparer.Finish(run, options);
  return {std::move(run), std::move(comparison)};
}

double ValueOf(const std::map<std::string, Spread>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? std::nan("") : found->second.mean;
}

// In a linear problem a filter has no linearisation error, and the smoother equals the batch. The
// error of the filter is then due to missing smoothing only.
TEST(CompareLinear, OnlyMissingSmoothingIsLeftOfTheGap) {
  const auto [run, comparison] = CompareLinear(false);
  ASSERT_EQ(comparison.decomposition.size(), 3u);
  EXPECT_EQ(comparison.decomposed, "ekf");
  const DecompositionStep& linearisation = comparison.decomposition[0];
  EXPECT_EQ(linearisation.estimator + ' ' + linearisation.reference, "ekf full_information");
  EXPECT_LT(ValueOf(linearisation.values, "rmsd:p.x"), 1e-9);
  EXPECT_LT(ValueOf(linearisation.values, "rmsd:p.v"), 1e-9);
  EXPECT_LT(ValueOf(linearisation.values, "rmsd.sigmas:p"), 1e-9);
  EXPECT_NEAR(linearisation.ratios.at("rmse:p.x").value(), 1.0, 1e-9);

  const DecompositionStep& smoothing = comparison.decomposition[1];
  EXPECT_EQ(smoothing.estimator + ' ' + smoothing.reference, "ekf rts");
  const auto rmse = [&run = run](std::size_t e) {
    return run.estimators[e].metrics.at("rmse:p.x");
  };
  EXPECT_GT(rmse(0) / rmse(1), 1.2);
  EXPECT_NEAR(smoothing.ratios.at("rmse:p.x").value(), rmse(0) / rmse(1), 1e-12);

  const DecompositionStep& rejected = comparison.decomposition[2];
  EXPECT_EQ(rejected.estimator + ' ' + rejected.reference, "accepted batch");
  EXPECT_EQ(ValueOf(rejected.values, "rejected"), 0.0);
  EXPECT_LT(ValueOf(rejected.values, "rmsd:p.x"), 1e-12);

  const ComparedEstimator& rts = comparison.estimators[1];
  EXPECT_TRUE(rts.smoothed);
  EXPECT_EQ(rts.reference, "batch");
  EXPECT_LT(ValueOf(rts.values, "rmsd:p.x"), 1e-9);
  EXPECT_LT(ValueOf(rts.values, "rmsd.sigmas:p"), 1e-9);
  EXPECT_NEAR(rts.ratios.at("rmse:p.x").value(), 1.0, 1e-9);
}

TEST(CompareLinear, AWindowIsNoSmootherOfAllData) {
  const DecompositionStep smoothing =
      CompareLinear(false, {}, EstimatorKind::kSlidingWindow).comparison.decomposition[1];
  EXPECT_EQ(smoothing.estimator + ' ' + smoothing.reference, "full_information accepted");
}

// At the last frame the filter and the batch have the same data.
TEST(CompareLinear, TheLastEstimateOfAFilterIsThatOfTheBatch) {
  const Comparison comparison = CompareLinear(false).comparison;
  const ComparedEstimator& ekf = comparison.estimators[0];
  EXPECT_EQ(ekf.reference, "full_information");
  EXPECT_EQ(ekf.final_reference, "batch");
  EXPECT_LT(ValueOf(ekf.values, "final_difference:p.x"), 1e-9);
  EXPECT_LT(ValueOf(ekf.values, "final_difference.sigmas:p"), 1e-9);
  EXPECT_NEAR(ekf.ratios.at("final_error:p.x").value(), 1.0, 1e-7);
}

/// Values of p.x and p.v for each frame, computed by hand: those of the filter, and those of the
/// smoother with their covariance.
struct ByHand {
  std::vector<Eigen::Vector2d> filter, smoother;
  std::vector<Eigen::Matrix2d> p;
};

ByHand RunByHand() {
  const Problem problem = LinearSystem();
  Swing source;
  EkfOptions options;
  options.gate = 0.9999;
  Ekf ekf(problem, options, source.streams());
  RtsSmoother rts(problem, options, source.streams());
  ByHand run;
  for (SourceFrame frame; source.Next(frame);) {
    ekf.Process(frame);
    rts.Process(frame);
    run.filter.emplace_back(ekf.state().values().data());
  }
  rts.Smooth([&](std::size_t, const State& state, const UpdateReport&) {
    run.smoother.emplace_back(state.values().data());
    run.p.emplace_back(state.covariance().Block(0, 2, 0, 2));
  });
  return run;
}

// Compares the distance between a filter and a smoother, in joint sigmas of position and velocity,
// with the distance computed here.
TEST(CompareLinear, DistancesAreThoseWrittenOut) {
  const ByHand by_hand = RunByHand();
  double squares = 0.0, sigmas = 0.0;
  for (std::size_t k = 0; k < by_hand.filter.size(); ++k) {
    const Eigen::Vector2d d = by_hand.filter[k] - by_hand.smoother[k];
    squares += d[0] * d[0];
    sigmas += d.dot(by_hand.p[k].inverse() * d) / 2.0;
  }
  const auto n = static_cast<double>(by_hand.filter.size());
  const DecompositionStep smoothing = CompareLinear(false).comparison.decomposition[1];
  EXPECT_NEAR(ValueOf(smoothing.values, "rmsd:p.x"), std::sqrt(squares / n), 1e-12);
  EXPECT_NEAR(ValueOf(smoothing.values, "rmsd.sigmas:p"), std::sqrt(sigmas / n), 1e-9);
}

// The batch uses the outlier. The filter rejects it, so the estimators that use the accepted data
// of the filter do not use it either.
TEST(CompareLinear, WhatTheGateKeptOutIsLostData) {
  const Comparison comparison = CompareLinear(true).comparison;
  EXPECT_LT(ValueOf(comparison.decomposition[0].values, "rmsd:p.x"), 1e-9);
  const DecompositionStep& rejected = comparison.decomposition[2];
  EXPECT_EQ(ValueOf(rejected.values, "rejected"), 1.0);
  EXPECT_EQ(ValueOf(rejected.values, "measurements"), 23.0);
  EXPECT_GT(ValueOf(rejected.values, "rmsd:p.x"), 0.5);
  EXPECT_LT(rejected.ratios.at("rmse:p.x").value(), 0.5);
}

TEST(CompareLinear, ANamedReferenceServesAll) {
  const Comparison comparison = CompareLinear(false, {"rts", "", true}).comparison;
  EXPECT_EQ(comparison.reference, "rts");
  for (const ComparedEstimator& one : comparison.estimators) {
    EXPECT_EQ(one.reference, "rts") << one.name;
    EXPECT_FALSE(one.values.contains("rmse:p.x")) << one.name;
    EXPECT_EQ(one.values.contains("rmsd:p.x"), one.name != "rts");
  }
}

// ---- estimators that a comparison adds to a config ----------------------------------------------

Config Depth(const std::vector<std::pair<std::string, std::string>>& settings = {}) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml");
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  return config;
}

/// Returns options with which the added estimators do not depend on the speed of the machine.
CompareOptions With(FullInformation condition) {
  CompareOptions options;
  options.full_information = condition;
  return options;
}

TEST(BuildComparedExperiment, AddsWhatTheComparisonLacks) {
  const ComparedExperiment compared =
      BuildComparedExperiment(Depth(), Shipped(), With(FullInformation::kAlways));
  EXPECT_EQ(compared.filter, "ekf");
  EXPECT_EQ(compared.added,
            (std::vector<std::string>{"rts", "batch", "full_information", "batch_accepted"}));
  const Node estimators = compared.config.root().At("estimators");
  EXPECT_EQ(estimators.At("full_information").At("mode").Text(), "filtering");
  EXPECT_EQ(estimators.At("batch_accepted").At("use").At("accepted_by").Text(), "ekf");
  EXPECT_EQ(estimators.At("rts").At("gate").Text(), estimators.At("ekf").At("gate").Text());
  // The resulting config is valid for a run.
  EXPECT_EQ(BuildExperiment(compared.config, Shipped()).estimators.size(), 5u);
}

TEST(BuildComparedExperiment, AddsNothingThatIsThereOrNotAskedFor) {
  const Config config = Depth({{"estimators.best", "{type: ceres_batch}"},
                               {"estimators.best_now", "{type: ceres_batch, mode: filtering}"}});
  EXPECT_EQ(BuildComparedExperiment(config, Shipped(), {}).added,
            (std::vector<std::string>{"rts", "batch_accepted"}));
  EXPECT_TRUE(BuildComparedExperiment(config, Shipped(), {"", "", false}).added.empty());
}

TEST(BuildComparedExperiment, TakesOverWhatTheFilterSees) {
  const Config config = Depth({{"estimators.ekf.sensors", "[stereo]"},
                               {"estimators.ekf.overrides.sensors.stereo.sigma_px", "2"},
                               {"estimators.best", "{type: ceres_batch}"}});
  const ComparedExperiment compared =
      BuildComparedExperiment(config, Shipped(), With(FullInformation::kAlways));
  // `best` has a different sensor and a different noise.
  EXPECT_EQ(compared.added,
            (std::vector<std::string>{"rts", "batch", "full_information", "batch_accepted"}));
  for (const EstimatorSpec& named : compared.experiment.estimators) {
    EXPECT_EQ(named.problem.sensors.size(), named.name == "best" ? 2u : 1u) << named.name;
    EXPECT_EQ(named.overrides.empty(), named.name == "best") << named.name;
  }
}

// A solve at every frame takes more than half of the time. Over 10^7 runs it takes more than 10 s
// on any machine.
TEST(BuildComparedExperiment, OmitsASlowFullInformationFilter) {
  const std::vector<std::string> others = {"rts", "batch", "batch_accepted"};
  CompareOptions options;
  options.over_seeds = true;
  options.runs = 10'000'000;
  const ComparedExperiment slow = BuildComparedExperiment(Depth(), Shipped(), options);
  EXPECT_EQ(slow.added, others);
  EXPECT_TRUE(slow.too_slow.starts_with(
      "the comparison omits the full-information filter: it would take about "))
      << slow.too_slow;
  EXPECT_TRUE(slow.too_slow.ends_with("; --full-information always includes it")) << slow.too_slow;
  // The prediction has read the first frames of the source, so the experiment must be a new one.
  SourceFrame frame;
  ASSERT_TRUE(slow.experiment.source->Next(frame));
  EXPECT_EQ(frame.timestamp, TimestampFromSeconds(0.0));

  options.full_information = FullInformation::kAlways;
  const ComparedExperiment always = BuildComparedExperiment(Depth(), Shipped(), options);
  EXPECT_EQ(always.added.size(), 4u);
  EXPECT_EQ(always.too_slow, "");
  const ComparedExperiment never =
      BuildComparedExperiment(Depth(), Shipped(), With(FullInformation::kNever));
  EXPECT_EQ(never.added, others);
  EXPECT_EQ(never.too_slow, "");
}

TEST(BuildComparedExperiment, LeavesOutWithItsReasonWhatDoesNotSupportTheSystem) {
  const Config config =
      Config::FromFile(ALIDADE_SOURCE_DIR "/examples/04_depth_fused_2017/config.yaml");
  const ComparedExperiment compared = BuildComparedExperiment(config, Shipped(), {});
  EXPECT_TRUE(compared.added.empty());
  ASSERT_EQ(compared.notes.size(), 2u);
  EXPECT_TRUE(
      compared.notes[0].starts_with("the comparison omits the batch of all data; the "
                                    "full-information filter of the accepted measurements; "))
      << compared.notes[0];
  EXPECT_EQ(compared.notes[1],
            "the comparison omits the smoother of all data: estimator type 'rts' does not support "
            "jacobian_at: measurement");
  EXPECT_EQ(compared.experiment.estimators.size(), 1u);
}

TEST(BuildComparedExperiment, RefusesNamesThatAreNotThereOrNoFilters) {
  const auto refuses = [](const CompareOptions& options, const std::string& words) {
    try {
      BuildComparedExperiment(Depth(), Shipped(), options);
      ADD_FAILURE() << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      EXPECT_TRUE(std::string(error.what()).starts_with(words)) << error.what();
    }
  };
  refuses({"bath", "", true},
          "--reference: no estimator has the name 'bath'; expected one of ekf, rts");
  refuses({"", "efk", true},
          "--filter: no estimator has the name 'efk'; expected one of ekf; did you mean");
}

TEST(BuildComparedExperiment, RefusesToExplainTheGapOfABatchOrASmoother) {
  const Config config = Depth({{"estimators.rts", "{type: rts}"},
                               {"estimators.best", "{type: ceres_batch}"},
                               {"estimators.now", "{type: ceres_batch, mode: filtering}"}});
  for (const char* name : {"rts", "best", "now"}) {
    try {
      BuildComparedExperiment(config, Shipped(), {"", name, true});
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      EXPECT_EQ(std::string(error.what()), std::string("--filter: '") + name +
                                               "' is not an online filter; expected one of ekf");
    }
  }
}

// ---- with landmarks -----------------------------------------------------------------------------

Comparison CompareScene(const std::string& more) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml");
  config.Set("source.max_frames", "6", "--set");
  if (!more.empty()) config.Set("estimators.now", more, "--set");
  ComparedExperiment compared =
      BuildComparedExperiment(config, Shipped(), With(FullInformation::kNever));
  RunComparer comparer(compared.experiment);
  RunOptions observed;
  observed.observers.push_back(&comparer);
  const RunResult run = Run(compared.experiment, observed);
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  return comparer.Finish(run, {});
}

// The full-information filter `now` solves at every frame. At the last frame, its estimate equals
// that of the batch.
TEST(CompareLandmarks, AtTheLastFrameTheBatchOfAllDataIsThatOfTheDataSoFar) {
  const DecompositionStep step = CompareScene("").decomposition[0];
  EXPECT_TRUE(step.at_end);
  EXPECT_EQ(step.estimator + ' ' + step.reference, "ekf batch_accepted");
  const Comparison with =
      CompareScene("{type: ceres_batch, mode: filtering, use: {accepted_by: ekf}}");
  EXPECT_FALSE(with.decomposition[0].at_end);
  ASSERT_EQ(with.estimators[1].name, "now");
  const std::map<std::string, Spread>& now = with.estimators[1].values;
  EXPECT_LT(ValueOf(now, "final_difference.sigmas:cam"), 1e-5);
  EXPECT_LT(ValueOf(now, "map.rmsd"), 1e-6);
  const double of_end = ValueOf(now, "final_error:cam.position");
  EXPECT_NEAR(ValueOf(step.values, "rmse.to:cam.position"), of_end, 1e-6 * of_end);
  EXPECT_NEAR(ValueOf(step.values, "rmse.to:map"), ValueOf(now, "map.rmse"), 1e-6);
  EXPECT_GT(step.ratios.at("rmse:map").value(), 0.0);
  EXPECT_GT(ValueOf(step.values, "rmsd.sigmas:cam"), 0.01);
}

// ---- over seeds ---------------------------------------------------------------------------------

// In example 01 with seed 4 the EKF diverges and the UKF does not.
TEST(CompareSeeds, WhatIsHeldAgainstAReferenceThatDivergedIsLeftOut) {
  Config config = Config::FromFile(ALIDADE_SOURCE_DIR "/examples/01_depth_stereo_only/config.yaml");
  config.Set("estimators.ukf", "{type: ukf}", "--set");
  CompareOptions options;
  options.reference = "ekf";
  options.decompose = false;
  const ComparedExperiment compared = BuildComparedExperiment(config, Shipped(), options);
  const auto compare = [&](std::uint64_t first_seed, std::int64_t runs) {
    SweepOptions sweep;
    sweep.first_seed = first_seed;
    sweep.runs = runs;
    return CompareSeeds(compared, Shipped(), sweep, options).comparison;
  };
  const Comparison both = compare(4, 2), second = compare(5, 1);
  ASSERT_EQ(both.estimators[0].diverged, 1);
  const ComparedEstimator& ukf = both.estimators[1];
  EXPECT_EQ(ukf.reference, "ekf");
  EXPECT_EQ(ukf.final_reference, "ekf");
  EXPECT_EQ(ukf.used, 2);
  EXPECT_EQ(ukf.reference_runs, 1);
  EXPECT_EQ(ukf.final_reference_runs, 1);
  for (const char* key : {"rmsd:target.depth", "final_difference:target.depth"}) {
    EXPECT_GT(ValueOf(ukf.values, key), 0.0) << key;
    EXPECT_EQ(ValueOf(ukf.values, key), ValueOf(second.estimators[1].values, key)) << key;
  }
  EXPECT_EQ(both.withheld,
            "no reference is available: estimator 'ekf' failed, so the comparison with this "
            "estimator is withheld (1 of 2 runs)");
  const std::string text = CompareReport(both, TableStyle::kMarkdown);
  EXPECT_NE(text.find("ratios and differences relative to ekf"), text.npos) << text;
  EXPECT_NE(text.find("runs with a reference"), text.npos) << text;
}

}  // namespace
}  // namespace alidade
