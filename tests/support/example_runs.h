// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "alidade/experiment/run.h"

/// Functions that run the shipped examples and average their metrics over seeds.
namespace alidade::testing {

using Settings = std::vector<std::pair<std::string, std::string>>;

/// Returns the plugins of the build. They are loaded once for all runs, because no example names
/// other plugins.
inline const PluginHost& ExampleHost() {
  static const PluginHost host(std::vector<std::filesystem::path>{});
  return host;
}

inline RunResult RunExample(const std::string& name, const Settings& settings,
                            const std::string& file = "config.yaml") {
  Config config =
      Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples" / name / file);
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  Experiment experiment = BuildExperiment(config, ExampleHost());
  return Run(experiment, {});
}

/// Means over the runs that did not diverge.
struct Means {
  int used = 0;      ///< number of runs that did not diverge
  int diverged = 0;  ///< number of runs that diverged
  int lost = 0;      ///< number of runs with the verdict `lost`
  std::map<std::string, double> metrics, squares;
  double operator[](const std::string& key) const { return metrics.at(key); }
  /// Returns the standard error of a mean.
  double Error(const std::string& key) const {
    const double mean = metrics.at(key), variance = squares.at(key) - mean * mean;
    return std::sqrt(std::max(variance, 0.0) / (used - 1));
  }
};

/// Runs an example with the seeds 1001 to 1000 + `runs`.
inline std::map<std::string, Means> Sweep(const std::string& name, const Settings& settings = {},
                                          const std::string& file = "config.yaml", int runs = 200) {
  std::map<std::string, Means> means;
  for (int seed = 1001; seed <= 1000 + runs; ++seed) {
    Settings with_seed = settings;
    with_seed.emplace_back("source.seed", std::to_string(seed));
    const RunResult run = RunExample(name, with_seed, file);
    EXPECT_EQ(run.status, RunStatus::kOk) << name << " seed " << seed << ": " << run.reason;
    for (const EstimatorResult& result : run.estimators) {
      Means& mean = means[result.name];
      if (result.diverged) {
        ++mean.diverged;
        continue;
      }
      ++mean.used;
      mean.lost += result.verdict.state == VerdictState::kLost ? 1 : 0;
      for (const auto& [key, value] : result.metrics) {
        mean.metrics[key] += value;
        mean.squares[key] += value * value;
      }
    }
  }
  for (auto& [estimator, mean] : means) {
    for (auto& [key, value] : mean.metrics) value /= mean.used;
    for (auto& [key, value] : mean.squares) value /= mean.used;
  }
  return means;
}

}  // namespace alidade::testing
