// SPDX-License-Identifier: Apache-2.0
//
// The shipped examples, run as they are, held against the figures that docs/experiments.md states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "alidade/run.h"

namespace alidade {
namespace {

const std::filesystem::path kExamples = std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples";

#if defined(ALIDADE_WITHOUT_CERES)
constexpr bool kHasCeres = false;
#else
constexpr bool kHasCeres = true;
#endif

using Settings = std::vector<std::pair<std::string, std::string>>;

RunResult RunExample(const std::string& name, const Settings& settings) {
  Config config = Config::FromFile(kExamples / name / "config.yaml");
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  const PluginHost host(PluginPaths(config));
  Experiment experiment = BuildExperiment(config, host);
  return Run(experiment, {});
}

/// Means over the reporting seeds 1001-1200 of the runs that did not diverge.
struct Means {
  int diverged = 0;
  std::map<std::string, double> metrics;
  double operator[](const std::string& key) const { return metrics.at(key); }
};

std::map<std::string, Means> Sweep(const std::string& name) {
  std::map<std::string, Means> means;
  std::map<std::string, int> used;
  for (int seed = 1001; seed <= 1200; ++seed) {
    const RunResult run = RunExample(name, {{"source.seed", std::to_string(seed)}});
    EXPECT_EQ(run.status, RunStatus::kOk) << name << " seed " << seed << ": " << run.reason;
    for (const EstimatorResult& result : run.estimators) {
      Means& mean = means[result.name];
      if (result.diverged) {
        ++mean.diverged;
        continue;
      }
      ++used[result.name];
      for (const auto& [key, value] : result.metrics) mean.metrics[key] += value;
    }
  }
  for (auto& [estimator, mean] : means) {
    for (auto& [key, value] : mean.metrics) value /= used[estimator];
  }
  return means;
}

bool HasEvent(const EstimatorResult& result, const std::string& kind) {
  return std::any_of(result.events.begin(), result.events.end(),
                     [&](const Event& event) { return event.kind == kind; });
}

TEST(Examples, EveryExampleRuns) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kExamples)) {
    if (!std::filesystem::exists(entry.path() / "config.yaml")) continue;
    if (!kHasCeres && entry.path().filename() == "08_depth_all_estimators") continue;
    ++count;
    const RunResult run = RunExample(entry.path().filename(), {});
    EXPECT_EQ(run.status, RunStatus::kOk) << entry.path();
    EXPECT_EQ(run.code, ExitCode::kOk) << entry.path();
    EXPECT_TRUE(std::filesystem::exists(entry.path() / "README.md")) << entry.path();
  }
  EXPECT_GE(count, 7);
}

// Experiment 4.1: the prediction crosses Z = 0 in about half of the runs, which is reported.
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
      if (event.kind != "diverged") continue;
      EXPECT_GT(Seconds(event.stamp), 1.0) << "seed " << seed;
    }
  }
  EXPECT_GT(diverged, 70);
  EXPECT_LT(diverged, 140);
}

// Experiment 4.2: only the product lambda Z is seen.
TEST(Examples, ScaleOnlyReportsThatLambdaIsUnobservable) {
  const RunResult run = RunExample("02_depth_scale_only", {});
  EXPECT_EQ(run.code, ExitCode::kOk);
  const EstimatorResult& ekf = run.estimators.at(0);
  EXPECT_TRUE(ekf.diverged);
  ASSERT_EQ(ekf.unobservable.size(), 1u);
  EXPECT_EQ(ekf.unobservable[0].back(), "template.inverse_distance");
  EXPECT_TRUE(HasEvent(ekf, "unobservable"));
}

// Experiment 4.3: lag against noise.
TEST(Examples, ScaleHeldTradesLagForNoise) {
  const auto means = Sweep("03_depth_scale_held");
  const Means &slow = means.at("R2_5"), &fast = means.at("R2_0_0005");
  EXPECT_EQ(slow.diverged, 0);
  EXPECT_EQ(fast.diverged, 0);
  EXPECT_GE(slow["rmse:target.depth"], 0.057);
  EXPECT_LE(slow["rmse:target.depth"], 0.062);
  EXPECT_GE(slow["lag_ms:target.depth"], 350.0);
  EXPECT_LE(slow["lag_ms:target.depth"], 400.0);
  EXPECT_GE(fast["rmse:target.depth"], 0.0025);
  EXPECT_LE(fast["rmse:target.depth"], 0.0032);
  EXPECT_LT(fast["lag_ms:target.depth"], 8.0);
}

// Experiment 5, and the principled filter on the same seeds.
TEST(Examples, ThePrincipledFilterBeatsTheFusedFilterOf2017) {
  const Means fused = Sweep("04_depth_fused_2017").at("ekf");
  EXPECT_EQ(fused.diverged, 0);
  EXPECT_GE(fused["rmse:target.depth"], 0.0019);
  EXPECT_LE(fused["rmse:target.depth"], 0.0025);
  EXPECT_GE(fused["rmse:target.depth_rate"], 0.034);
  EXPECT_LE(fused["rmse:target.depth_rate"], 0.043);
  EXPECT_LT(std::abs(fused["lag_ms:target.depth"]), 3.0);

  const Means principled = Sweep("05_depth_principled").at("ekf");
  EXPECT_EQ(principled.diverged, 0);
  EXPECT_LE(principled["rmse:target.depth"], 0.0021);
  EXPECT_LE(principled["rmse:target.depth_rate"], 0.035);
  EXPECT_LE(principled["rmse:target.depth"], 0.93 * fused["rmse:target.depth"]);
  EXPECT_LE(principled["rmse:target.depth_rate"], 0.90 * fused["rmse:target.depth_rate"]);
  for (const char* key : {"nees.cov95:target@blind", "nees.cov95:target@seeing"}) {
    EXPECT_GE(principled[key], 0.95) << key;
    EXPECT_LE(principled[key], 0.995) << key;
  }
}

// A start that is off by 5 cm, and by 10 % in lambda, under priors that say so.
TEST(Examples, TheIteratedFilterStartsFromFarAway) {
  const auto means = Sweep("06_depth_poor_start");
  const Means &ekf = means.at("ekf"), &iekf = means.at("iekf");
  EXPECT_EQ(iekf.diverged, 0);
  EXPECT_LE(iekf["rmse:target.depth"], 0.0021);
  EXPECT_LT(iekf["rmse:target.depth"], 0.95 * ekf["rmse:target.depth"]);
  for (const char* key : {"nees.cov95:target@blind", "nees.cov95:target@seeing"}) {
    EXPECT_GE(iekf[key], 0.95) << key;
    EXPECT_LE(iekf[key], 0.995) << key;
  }
}

/// Every second series, from the second on: the noise was chosen on the others.
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
  if (files.empty()) GTEST_SKIP() << "ALIDADE_DATA has no kitti-depth-pairs";
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

}  // namespace
}  // namespace alidade
