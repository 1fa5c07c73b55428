// SPDX-License-Identifier: Apache-2.0
//
// Runs the shipped examples unchanged and compares their results with the numbers in
// docs/experiments.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "alidade/base/number_text.h"
#include "alidade/experiment/run.h"
#include "alidade/record/simulate.h"
#include "support/example_runs.h"
#include "support/temporary_folder.h"

namespace alidade {
namespace {

const std::filesystem::path kExamples = std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples";

#if defined(ALIDADE_WITHOUT_CERES)
constexpr bool kHasCeres = false;
#else
constexpr bool kHasCeres = true;
#endif

using testing::Means;
using testing::RunExample;
using testing::Settings;
using testing::Sweep;

const PluginHost& Host() { return testing::ExampleHost(); }

bool HasEvent(const EstimatorResult& result, EventKind kind) {
  return std::any_of(result.events.begin(), result.events.end(),
                     [&](const Event& event) { return event.kind == kind; });
}

TEST(Examples, EveryExampleRuns) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kExamples)) {
    if (!std::filesystem::exists(entry.path() / "config.yaml")) continue;
    if (!kHasCeres && entry.path().filename() == "08_depth_all_estimators") continue;
    // The recordings are not in this repository. SlamOdometryTracks, SlamStereoTracks and
    // RecordedRobots test these examples.
    const std::string name = entry.path().filename().string();
    const auto is_recorded = [&](const char* ending) { return name.ends_with(ending); };
    if (is_recorded("_tracks") || is_recorded("_files") || is_recorded("_ranges")) continue;
    // These examples need rendered images.
    if (entry.path().filename().string().ends_with("_images")) continue;
    ++count;
    const RunResult run = RunExample(entry.path().filename(), {});
    EXPECT_EQ(run.status, RunStatus::kOk) << entry.path();
    EXPECT_EQ(run.code, ExitCode::kOk) << entry.path();
    EXPECT_TRUE(std::filesystem::exists(entry.path() / "README.md")) << entry.path();
  }
  EXPECT_GE(count, 7);
}

// Experiment 4.1: the predicted depth crosses Z = 0 in about half of the runs, and the filter
// reports its divergence.
TEST(Examples, StereoOnlyReportsItsDivergence) {
  int diverged = 0;
  for (int seed = 1001; seed <= 1200; ++seed) {
    const RunResult run =
        RunExample("01_depth_stereo_only", {{"source.seed", std::to_string(seed)}});
    ASSERT_EQ(run.code, ExitCode::kOk);
    const EstimatorResult& ekf = run.estimators.at(0);
    if (!ekf.diverged) continue;
    ++diverged;
    for (const Event& event : ekf.events) {
      if (event.kind != EventKind::kDiverged) continue;
      EXPECT_GT(Seconds(event.timestamp), 1.0) << "seed " << seed;
    }
  }
  EXPECT_GT(diverged, 70);
  EXPECT_LT(diverged, 140);
}

// Experiment 4.2: a scale sensor alone observes only the product lambda Z.
TEST(Examples, ScaleOnlyReportsThatLambdaIsUnobservable) {
  const RunResult run = RunExample("02_depth_scale_only", {});
  EXPECT_EQ(run.code, ExitCode::kOk);
  const EstimatorResult& ekf = run.estimators.at(0);
  EXPECT_LE(ekf.verdict.state, VerdictState::kLost);
  EXPECT_TRUE(HasEvent(ekf, EventKind::kLost));
  ASSERT_EQ(ekf.unobservable.size(), 1u);
  EXPECT_EQ(ekf.unobservable[0].back(), "template.inverse_distance");
  EXPECT_TRUE(HasEvent(ekf, EventKind::kUnobservable));
}

// Experiment 4.3: a larger R2 reduces the noise of the estimate but increases its lag.
TEST(Examples, ScaleHeldTradesLagForNoise) {
  const auto means = Sweep("03_depth_scale_known");
  const Means &slow = means.at("R2_5"), &fast = means.at("R2_0_0005");
  EXPECT_EQ(slow.diverged + slow.lost, 0);
  EXPECT_EQ(fast.diverged + fast.lost, 0);
  EXPECT_GE(slow["rmse:target.depth"], 0.057);
  EXPECT_LE(slow["rmse:target.depth"], 0.062);
  EXPECT_GE(slow["lag_ms:target.depth"], 350.0);
  EXPECT_LE(slow["lag_ms:target.depth"], 400.0);
  EXPECT_GE(fast["rmse:target.depth"], 0.0025);
  EXPECT_LE(fast["rmse:target.depth"], 0.0032);
  EXPECT_LT(fast["lag_ms:target.depth"], 8.0);
}

// Experiment 5: compares the fused filter of 2017 with the principled filter on the same seeds.
TEST(Examples, ThePrincipledFilterBeatsTheFusedFilterOf2017) {
  const Means fused = Sweep("04_depth_fused_2017").at("ekf");
  EXPECT_EQ(fused.diverged + fused.lost, 0);
  EXPECT_GE(fused["rmse:target.depth"], 0.0019);
  EXPECT_LE(fused["rmse:target.depth"], 0.0025);
  EXPECT_GE(fused["rmse:target.depth_rate"], 0.034);
  EXPECT_LE(fused["rmse:target.depth_rate"], 0.043);
  EXPECT_LT(std::abs(fused["lag_ms:target.depth"]), 3.0);

  const Means principled = Sweep("05_depth_principled").at("ekf");
  EXPECT_EQ(principled.diverged + principled.lost, 0);
  EXPECT_LE(principled["rmse:target.depth"], 0.0021);
  EXPECT_LE(principled["rmse:target.depth_rate"], 0.035);
  EXPECT_LE(principled["rmse:target.depth"], 0.93 * fused["rmse:target.depth"]);
  EXPECT_LE(principled["rmse:target.depth_rate"], 0.90 * fused["rmse:target.depth_rate"]);
  for (const char* key : {"nees.within95:target@blind", "nees.within95:target@seeing"}) {
    EXPECT_GE(principled[key], 0.95) << key;
    EXPECT_LE(principled[key], 0.995) << key;
  }
}

// The initial estimate has an error of 5 cm in depth and of 10 % in lambda. The prior sigmas equal
// these errors.
TEST(Examples, TheIteratedFilterStartsFromFarAway) {
  const auto means = Sweep("06_depth_poor_initial");
  const Means &ekf = means.at("ekf"), &iekf = means.at("iekf");
  EXPECT_EQ(iekf.diverged + iekf.lost, 0);
  EXPECT_LE(iekf["rmse:target.depth"], 0.0021);
  EXPECT_LT(iekf["rmse:target.depth"], 0.95 * ekf["rmse:target.depth"]);
  for (const char* key : {"nees.within95:target@blind", "nees.within95:target@seeing"}) {
    EXPECT_GE(iekf[key], 0.95) << key;
    EXPECT_LE(iekf[key], 0.995) << key;
  }
}

/// Returns the RMS difference between the first two estimators of the example in their estimates of
/// a block.
double RmsApart(const std::string& name, int seed, const std::string& block) {
  Config config = Config::FromFile(kExamples / name / "config.yaml");
  config.Set("source.seed", std::to_string(seed), "--set");
  Experiment experiment = BuildExperiment(config, Host());
  double squares = 0.0;
  int count = 0;
  for (SourceFrame frame; experiment.source->Next(frame); ++count) {
    std::vector<double> values;
    for (const EstimatorSpec& named : experiment.estimators) {
      named.estimator->Process(frame);
      const State& state = named.estimator->state();
      values.push_back(*state.value(state.layout().Find(block)));
    }
    squares += std::pow(values.at(0) - values.at(1), 2);
  }
  return std::sqrt(squares / count);
}

// Experiment 5: "the order probably does not matter". In the prototype the RMS difference was 0.026
// mm.
TEST(Examples, TheOrderOfTheTwoUpdatesHardlyMatters) {
  const auto means = Sweep("17_depth_update_order");
  const Means &stereo = means.at("stereo_first"), &scale = means.at("scale_first");
  EXPECT_EQ(stereo.diverged + stereo.lost, 0);
  EXPECT_EQ(scale.diverged + scale.lost, 0);
  EXPECT_GE(stereo["rmse:target.depth"], 0.0019);
  EXPECT_LE(stereo["rmse:target.depth"], 0.0025);
  EXPECT_NEAR(scale["rmse:target.depth"] / stereo["rmse:target.depth"], 1.0, 0.005);
  EXPECT_NEAR(scale["rmse:target.depth_rate"] / stereo["rmse:target.depth_rate"], 1.0, 0.005);
  double apart = 0.0;
  for (int seed = 1001; seed <= 1200; ++seed) {
    apart += RmsApart("17_depth_update_order", seed, "target.depth") / 200.0;
  }
  EXPECT_LE(apart, 3e-5);
  EXPECT_GE(apart, 1e-5)
      << "the order has an effect, because the first update moves the point of linearisation";
}

/// Returns sigma of the depth in example 18 after `updates` updates. Uses the scalar form of the
/// Riccati equation for x' = A x + G a, z = Z / Z0 + n, and starts from P = 100 I.
double RiccatiSigma(double r, int updates) {
  const double t = 0.033, h = 1.0 / 0.3;
  double p = 100.0, c = 0.0, v = 100.0;  // var(Z), cov(Z, rate), var(rate)
  for (int k = 0; k < updates; ++k) {
    if (k > 0) {
      p += 2.0 * t * c + t * t * v + std::pow(t, 4) / 4.0;
      c += t * v + std::pow(t, 3) / 2.0;
      v += t * t;
    }
    const double s = h * h * p + r;
    v -= h * h * c * c / s;
    c *= r / s;
    p *= r / s;
  }
  return std::sqrt(p);
}

/// Returns the square root of `variance` as text.
std::string RootText(const char* variance) {
  return internal::NumberText(std::sqrt(std::strtod(variance, nullptr)));
}

// Experiment 4.3: R2 varies over decades. A larger R2 gives more lag and less noise, and the filter
// fails at both ends.
TEST(Examples, LagAgainstNoiseHasAnOptimumAndTwoEndsThatFail) {
  const auto with = [](const char* r) {
    return Sweep("18_depth_noise_lag", {{"sensors.scale.sigma_inverse_scale", RootText(r)}})
        .at("ekf");
  };
  const Means best = with("5e-5");
  EXPECT_EQ(best.diverged + best.lost, 0);
  EXPECT_LE(best["rmse:target.depth"], 0.0023);
  for (const char* off : {"5e-6", "5e-4"}) {
    const Means ekf = with(off);
    EXPECT_GT(ekf["rmse:target.depth"], best["rmse:target.depth"]) << off;
    EXPECT_GT(ekf["rmse:target.depth_rate"], best["rmse:target.depth_rate"]) << off;
  }
  double lag = best["lag_ms:target.depth"];
  for (const char* r : {"5e-4", "5e-3", "5e-2", "0.5", "5"}) {
    const Means ekf = with(r);
    EXPECT_EQ(ekf.diverged + ekf.lost, 0) << r;
    EXPECT_GT(ekf["lag_ms:target.depth"], 1.4 * lag) << r;
    lag = ekf["lag_ms:target.depth"];
  }
  // R is a thousand times too small, so errors stay beyond 10 sigma.
  EXPECT_EQ(with("5e-9").lost, 200);
  // A constant estimate of 0.3 m has an RMSE of 0.1 m / sqrt(2). The RMSE of the filter is larger.
  EXPECT_GT(with("5000")["rmse:target.depth"], 0.0707);
}

TEST(Examples, TheGainSettlesWithinTheSeriesUpToR50) {
  const int updates = 152, many = 200'000;
  for (const char* r : {"5e-5", "0.5", "50", "500", "50000"}) {
    Config config = Config::FromFile(kExamples / "18_depth_noise_lag" / "config.yaml");
    config.Set("sensors.scale.sigma_inverse_scale", RootText(r), "--set");
    Experiment experiment = BuildExperiment(config, Host());
    ASSERT_EQ(alidade::Run(experiment, {}).status, RunStatus::kOk);
    const State& state = experiment.estimators.at(0).estimator->state();
    const Block& depth = state.layout()[state.layout().Find("target.depth")];
    const double sigma = std::sqrt(state.covariance().Variance(depth.tangent_offset));
    const double variance = std::strtod(r, nullptr);
    EXPECT_NEAR(sigma, RiccatiSigma(variance, updates), 1e-6 * sigma) << r;
    const bool settled = sigma < 1.05 * RiccatiSigma(variance, many);
    EXPECT_EQ(settled, variance <= 50.0) << r;
  }
}

/// Returns the 2nd, 4th, ... series. The noise was tuned on the other series.
std::vector<std::filesystem::path> ReportingSeries() {
  const char* data = std::getenv("ALIDADE_DATA");
  const std::filesystem::path folder =
      data == nullptr ? "" : std::filesystem::path(data) / "kitti-depth-pairs";
  std::vector<std::filesystem::path> files, reporting;
  if (data == nullptr || !std::filesystem::is_directory(folder)) return {};
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t i = 1; i < files.size(); i += 2) reporting.push_back(files[i]);
  return reporting;
}

double MetricOf(const RunResult& run, const std::string& estimator, const std::string& metric) {
  for (const EstimatorResult& result : run.estimators) {
    if (result.name == estimator) return result.metrics.at(metric);
  }
  return NAN;
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

TEST(Examples, RealSeriesAreBetterFusedThanByStereoAlone) {
  const auto files = ReportingSeries();
  if (files.empty()) GTEST_SKIP() << "ALIDADE_DATA does not contain kitti-depth-pairs";
  std::map<std::string, std::vector<double>> masked;
  double whole_fused = 0.0, whole_stereo = 0.0;
  for (const auto& file : files) {
    const RunResult blind = RunExample(
        "07_depth_pairs", {{"source.path", file.string()}, {"source.blind_after", "0.5"}});
    for (const char* name : {"fused", "stereo_only", "hold_last"}) {
      masked[name].push_back(MetricOf(blind, name, "rmse:target.depth@blind"));
    }
    const RunResult whole = RunExample("07_depth_pairs", {{"source.path", file.string()}});
    whole_fused += MetricOf(whole, "fused", "rmse:target.depth");
    whole_stereo += MetricOf(whole, "stereo_only", "rmse:target.depth");
  }
  EXPECT_LT(Median(masked["fused"]), Median(masked["stereo_only"]));
  EXPECT_LT(Median(masked["fused"]), Median(masked["hold_last"]));
  EXPECT_LE(whole_fused, whole_stereo);
}

const Settings kPoorStart = {{"state.target.initial.depth", "{mean: 0.35, sigma: 0.1}"},
                             {"state.target.initial.depth_rate", "{mean: 0, sigma: 0.5}"},
                             {"state.template.initial.inverse_distance", "{mean: 3, sigma: 1.5}"}};

// In a prototype, the smoother and the batch had errors of 1.03 mm and 11.7 mm/s, and 99 % of the
// NEES were within the 95 % bound.
TEST(Examples, TheSmootherHalvesTheErrorOfTheFilter) {
  if (!kHasCeres) GTEST_SKIP() << "this build does not contain the Ceres solver";
  const auto means = Sweep("08_depth_all_estimators");
  const Means &ekf = means.at("ekf"), &rts = means.at("rts"), &root = means.at("square_root");
  const Means& batch = means.at("batch");
  for (const auto& [name, mean] : means) EXPECT_EQ(mean.diverged + mean.lost, 0) << name;
  EXPECT_GE(rts["rmse:target.depth"], 0.00095);
  EXPECT_LE(rts["rmse:target.depth"], 0.0012);
  EXPECT_LE(rts["rmse:target.depth_rate"], 0.0125);
  EXPECT_GE(rts["nees.within95:target"], 0.98);
  EXPECT_LE(rts["nees.within95:target"], 0.999);
  EXPECT_LE(rts["rmse:target.depth"], 0.6 * ekf["rmse:target.depth"]);
  EXPECT_LE(batch["rmse:target.depth"], 0.0012);
  EXPECT_NEAR(rts["rmse:target.depth"] / batch["rmse:target.depth"], 1.0, 0.05);
  for (const char* key : {"rmse:target.depth", "nees.mean:target", "nis.mean:stereo"}) {
    EXPECT_NEAR(root[key], ekf[key], 1e-6 * ekf[key]) << key;
  }
  EXPECT_GE(means.at("ukf")["nees.within95:target"], 0.95);
  EXPECT_LE(means.at("ukf")["rmse:target.depth"], 0.0038);
}

// The prior is depth 0.35 +- 0.1 m and lambda 3 +- 1.5 /m. Sigma points at 3.9 sigma lie beyond the
// poles of both measurement models.
TEST(Examples, APoorStartDoesNotMakeTheUnscentedFilterDiverge) {
  Settings alone = kPoorStart;
  alone.emplace_back("estimators", "{ukf: {type: ukf, gate: 0.9999}}");
  const Means ukf = Sweep("08_depth_all_estimators", alone).at("ukf");
  EXPECT_EQ(ukf.diverged + ukf.lost, 0);
  EXPECT_LE(ukf["rmse:target.depth"], 0.0042);
  EXPECT_GE(ukf["nees.within95:target"], 0.95);
  Settings wide = kPoorStart;
  wide.emplace_back("estimators", "{ukf: {type: ukf, gate: none, alpha: 1, kappa: 12}}");
  for (int seed = 1001; seed <= 1020; ++seed) {
    wide.emplace_back("source.seed", std::to_string(seed));
    const RunResult run = RunExample("08_depth_all_estimators", wide);
    const auto result = std::ranges::find(run.estimators, "ukf", &EstimatorResult::name);
    ASSERT_NE(result, run.estimators.end());
    EXPECT_TRUE(HasEvent(*result, EventKind::kGuarded)) << seed;
    EXPECT_FALSE(result->diverged || result->verdict.state == VerdictState::kLost) << seed;
    for (const auto& [key, value] : result->metrics) {
      EXPECT_TRUE(std::isfinite(value)) << seed << ' ' << key;
    }
  }
}

// `simulate` writes one row for each satellite. `tables` combines six rows with one timestamp
// into a frame.
TEST(Examples, SatellitesFromATableGiveTheSameEstimates) {
  const testing::TemporaryFolder folder;
  const std::string example = "23_satellites";
  Simulate(Config::FromFile(kExamples / example / "config.yaml"), Host(), folder / "data", false);
  const std::string table = (folder / "data/ranges.csv").string();
  const RunResult straight = RunExample(example, {});
  const RunResult read = RunExample(
      example, {{"source", "{type: tables, path: " + table +
                               ", time: {repeats: true}, streams: {ranges: {columns: ranges, "
                               "known: [known0, known1, known2]}}}"}});
  EXPECT_EQ(read.frames, straight.frames);
  ASSERT_EQ(read.estimators.size(), straight.estimators.size());
  for (std::size_t i = 0; i < read.estimators.size(); ++i) {
    EXPECT_EQ(read.estimators[i].counts, straight.estimators[i].counts);
    EXPECT_GT(read.estimators[i].counts.at("accepted:gnss"), 300);
    for (const auto& [key, value] : read.estimators[i].metrics) {
      // Compares the metrics that do not need truth.
      EXPECT_EQ(value, straight.estimators[i].metrics.at(key)) << key;
    }
  }
}

TEST(Examples, WhatAnEstimatorTypeDoesNotHaveIsRefusedByName) {
  const std::vector<std::pair<std::string, std::string>> unsupported = {
      {"state.template.consider", "[inverse_distance]"},
      {"state.target.initial.depth", "{from_measurement: stereo}"},
      {"sensors.scale.roles",
       "{depth: target.depth, inverse_distance: {block: template.inverse_distance, mode: "
       "consider}}"},
      {"sensors.stereo.roles", "{depth: {block: target.depth, jacobian_at: measurement}}"}};
  for (const std::string type : {"rts", "square_root_ekf", "ukf"}) {
    for (const auto& [key, value] : unsupported) {
      try {
        RunExample("08_depth_all_estimators",
                   {{"estimators", "{one: {type: " + type + "}}"}, {key, value}});
        ADD_FAILURE() << type << " accepted " << key;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ExitCode::kBadConfig);
        const std::string text = error.what();
        EXPECT_NE(text.find("estimator type '" + type + "'"), std::string::npos) << text;
        EXPECT_NE(text.find("; expected "), std::string::npos) << text;
      }
    }
    const RunResult held =
        RunExample("08_depth_all_estimators", {{"estimators", "{one: {type: " + type + "}}"},
                                               {"sensors.scale.roles",
                                                "{depth: target.depth, inverse_distance: {block: "
                                                "template.inverse_distance, mode: known}}"}});
    EXPECT_EQ(held.status, RunStatus::kOk) << type;
  }
}

}  // namespace
}  // namespace alidade
