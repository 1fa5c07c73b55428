// SPDX-License-Identifier: Apache-2.0
//
// Runs the example 38 on the recording of a drone, with gaps of several lengths between its fixes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "support/program.h"

namespace alidade {
namespace {

class RecordedInertial : public ::testing::Test {
 protected:
  /// Runs a config of the example. `min_interval_s` replaces the interval between the fixes, unless
  /// it is empty.
  static void RunExample(const std::string& file, const std::string& min_interval_s,
                         RunResult& run) {
    const char* const data = std::getenv("ALIDADE_DATA");
    const auto recording = std::filesystem::path(data ? data : "/none") / "imu-euroc-v101";
    if (!std::filesystem::is_directory(recording)) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain imu-euroc-v101";
    }
    const auto path =
        std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples/38_inertial_navigation" / file;
    Config config = Config::FromFile(path);
    if (!min_interval_s.empty()) {
      std::string text = testing::ReadText(path);
      const std::string key = "min_interval_s: ", interval = key + "4.98";
      const std::size_t place = text.find(interval);
      ASSERT_NE(place, std::string::npos);
      text.replace(place, interval.size(), key + min_interval_s);
      config = Config::FromText(text, path.string());
    }
    config.Set("source.path", recording.string(), "--set");
    const PluginHost host(std::vector<std::filesystem::path>{});
    Experiment experiment = BuildExperiment(config, host);
    run = alidade::Run(experiment, {});
    ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  }
};

/// RMS errors of the position in the README of example 38.
struct Gap {
  const char* min_interval_s;
  double inertial, constant_velocity, inertial_smoother, constant_velocity_smoother;
};

void ExpectErrors(const std::vector<EstimatorResult>& estimators, const Gap& gap) {
  const std::map<std::string, double> figures = {
      {"inertial", gap.inertial},
      {"constant_velocity", gap.constant_velocity},
      {"inertial_smoother", gap.inertial_smoother},
      {"constant_velocity_smoother", gap.constant_velocity_smoother}};
  ASSERT_EQ(estimators.size(), figures.size());
  for (const EstimatorResult& estimator : estimators) {
    const bool is_inertial = estimator.name.starts_with("inertial");
    const char* const key = is_inertial ? "rmse:body.position" : "rmse:point.position";
    const double figure = figures.at(estimator.name);
    EXPECT_NEAR(estimator.metrics.at(key), figure, 0.05 * figure + 5e-4)
        << estimator.name << " " << gap.min_interval_s;
    EXPECT_NE(estimator.verdict.state, VerdictState::kLost) << estimator.name;
  }
}

TEST_F(RecordedInertial, AnInertialModelBridgesGapsAfterAStandstill) {
  for (const Gap& gap :
       {Gap{"0.98", 0.018, 0.161, 0.005, 0.023}, Gap{"1.98", 0.052, 0.495, 0.008, 0.087},
        Gap{"4.98", 0.399, 1.24, 0.045, 0.378}, Gap{"9.98", 2.26, 2.95, 0.177, 0.758}}) {
    RunResult run;
    RunExample("recorded.yaml", gap.min_interval_s, run);
    if (IsSkipped()) return;
    ExpectErrors(run.estimators, gap);
    const double nees = run.estimators.at(0).metrics.at("nees.mean:body");
    EXPECT_GE(nees, 0.75) << gap.min_interval_s;
    EXPECT_LE(nees, 1.15) << gap.min_interval_s;
  }
}

TEST_F(RecordedInertial, FrequentFixesMakeUnknownBiasesKnown) {
  RunResult run;
  RunExample("unknown_biases.yaml", "", run);
  if (IsSkipped()) return;
  ExpectErrors(run.estimators, {"4.98", 0.255, 1.24, 0.041, 0.360});
}

}  // namespace
}  // namespace alidade
