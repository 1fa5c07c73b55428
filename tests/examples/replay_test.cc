// SPDX-License-Identifier: Apache-2.0
//
// Compares all estimates of the examples with the recorded numbers in replay/NAME.csv. A change of
// the engine that is not meant to change an estimate must not change these numbers. This command
// rewrites the files; the commit must give the reason for the change:
//
//   ALIDADE_REPLAY_WRITE=1 test_examples --gtest_filter=*Replay*
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <ostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/number_text.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/source.h"
#include "drives.h"

namespace alidade {
namespace {

using ReplaySettings = std::vector<std::pair<std::string, std::string>>;
/// Numbers of each row, keyed by the name of the row.
using Figures = std::map<std::string, std::vector<double>>;

const std::filesystem::path kShipped = std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples";
const std::filesystem::path kReplay =
    std::filesystem::path(ALIDADE_SOURCE_DIR) / "tests/examples/replay";

/// Relative tolerance. Other machines round sin and cos differently, and a filter propagates the
/// difference.
constexpr double kTolerance = 1e-7;

/// Records every n-th estimate: the values of the problem's blocks, and |x|^2, tr P and |P|^2
/// including the landmarks. Also records the number of measurements with each outcome since the
/// previous record.
class Recording : public RunObserver {
 public:
  explicit Recording(int every) : every_(every) {}

  void Begin(const Experiment& experiment) override {
    for (const EstimatorSpec& one : experiment.estimators) series_.push_back({one.name, 0, {}});
    system_blocks_ = experiment.estimators.front().problem.layout.blocks().size();
  }
  void OnEstimate(int estimator, const SourceFrame& /*frame*/, const State& state,
                  const UpdateReport& report) override {
    Series& series = series_[static_cast<std::size_t>(estimator)];
    for (const MeasurementReport& one : report.measurements()) ++series.outcomes[one.outcome];
    if (series.frames++ % every_ != 0) return;
    std::vector<double> row;
    for (std::size_t id = 0; id < std::min(system_blocks_, state.layout().blocks().size()); ++id) {
      const Block& block = state.layout()[static_cast<BlockId>(id)];
      if (!block.present) continue;
      const double* const value = state.value(static_cast<BlockId>(id));
      row.insert(row.end(), value, value + block.geometry().ambient);
    }
    double squares = 0.0;
    for (const Block& block : state.layout().blocks()) {
      for (int i = 0; block.present && i < block.geometry().ambient; ++i) {
        squares += std::pow(state.values()[static_cast<std::size_t>(block.value_offset + i)], 2);
      }
    }
    const Eigen::MatrixXd p = state.covariance().Dense();
    row.insert(row.end(), {squares, p.trace(), p.squaredNorm()});
    for (const auto& [outcome, count] : series.outcomes) {
      row.push_back(static_cast<double>(static_cast<int>(outcome) * 100000 + count));
    }
    series.outcomes.clear();
    figures_[series.name + "/" + std::to_string(series.frames - 1)] = row;
  }
  const Figures& figures() const { return figures_; }

 private:
  struct Series {
    std::string name;
    int frames = 0;
    std::map<Outcome, int> outcomes;
  };

  int every_;
  std::size_t system_blocks_ = 0;
  std::vector<Series> series_;
  Figures figures_;
};

Figures ReadFigures(const std::filesystem::path& file) {
  Figures figures;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::string name, cell;
    std::getline(cells, name, ',');
    while (std::getline(cells, cell, ',')) figures[name].push_back(std::stod(cell));
  }
  return figures;
}

void WriteFigures(const Figures& figures, const std::filesystem::path& file) {
  std::ofstream out(file);
  for (const auto& [name, row] : figures) {
    out << name;
    for (const double value : row) out << ',' << internal::NumberText(value);
    out << '\n';
  }
}

void Compare(const Figures& found, const std::string& name) {
  const std::filesystem::path file = kReplay / (name + ".csv");
  if (std::getenv("ALIDADE_REPLAY_WRITE") != nullptr) return WriteFigures(found, file);
  const Figures expected = ReadFigures(file);
  ASSERT_FALSE(expected.empty()) << "this file contains no recorded numbers: " << file;
  ASSERT_EQ(found.size(), expected.size());
  int wrong = 0;
  for (const auto& [row, values] : expected) {
    ASSERT_TRUE(found.contains(row)) << row;
    const std::vector<double>& now = found.at(row);
    ASSERT_EQ(now.size(), values.size()) << row;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (now[i] == values[i]) continue;
      // A value near 0 may be the difference of two values near 1. Such a value is only as accurate
      // as these two values.
      if (std::abs(now[i] - values[i]) <= kTolerance * std::max(std::abs(values[i]), 1e-3))
        continue;
      ADD_FAILURE() << row << ", number " << i + 1 << ": " << now[i] << ", was " << values[i];
      if (++wrong == 5) return;  // the first differences locate the change
    }
  }
}

struct Replayed {
  std::string name, config;  ///< name of the recorded file, and path of the config under examples/
  int every;
  ReplaySettings settings;
};

void PrintTo(const Replayed& one, std::ostream* out) { *out << one.name; }

class Replay : public ::testing::TestWithParam<Replayed> {};

TEST_P(Replay, GivesTheFiguresOfBefore) {
  Config config = Config::FromFile(kShipped / GetParam().config);
  for (const auto& [key, value] : GetParam().settings) config.Set(key, value, "--set");
  const PluginHost host(std::vector<std::filesystem::path>{});
  Experiment experiment = BuildExperiment(config, host);
  Recording recording(GetParam().every);
  RunOptions options;
  options.observers = {&recording};
  const RunResult run = alidade::Run(experiment, options);
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  Compare(recording.figures(), GetParam().name);
}

const ReplaySettings kSlamEstimators = {{"estimators.iekf", "{type: iekf}"}};

INSTANTIATE_TEST_SUITE_P(
    Examples, Replay,
    ::testing::Values(
        Replayed{"05_depth_principled", "05_depth_principled/config.yaml", 10, {}},
        Replayed{"06_depth_poor_initial", "06_depth_poor_initial/config.yaml", 10, {}},
        Replayed{"07_depth_pairs", "07_depth_pairs/config.yaml", 5, {}},
        Replayed{"10_slam_scene", "10_slam_scene/config.yaml", 10, kSlamEstimators},
        Replayed{"15_slam_representations",
                 "15_slam_representations/config.yaml",
                 15,
                 {{"source.max_frames", "120"}, {"estimators.iekf", "{type: iekf}"}}}),
    [](const auto& instance) { return instance.param.name; });

#if !defined(ALIDADE_WITHOUT_CERES)
INSTANTIATE_TEST_SUITE_P(
    Batch, Replay,
    ::testing::Values(
        Replayed{"08_depth_all_estimators", "08_depth_all_estimators/config.yaml", 15, {}},
        Replayed{"08_fixed_lag", "08_depth_all_estimators/fixed_lag.yaml", 15, {}},
        Replayed{"10_batch", "10_slam_scene/batch.yaml", 20, {}}),
    [](const auto& instance) { return instance.param.name; });
#endif

/// For recorded drives only the metrics are stored, not the estimates.
class ReplayOfDrives : public testing::DrivesTest {};

TEST_F(ReplayOfDrives, GivesTheMetricsOfBefore) {
  Config config = ConfigOf("14_slam_stereo_tracks", "drive_0095", 60, {});
  const PluginHost host(std::vector<std::filesystem::path>{});
  Experiment experiment = BuildExperiment(config, host);
  const RunResult run = alidade::Run(experiment, {});
  ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  Figures figures;
  for (const auto& [name, value] : run.estimators.at(0).metrics) figures[name] = {value};
  for (const auto& [name, count] : run.estimators.at(0).counts) {
    figures[name] = {static_cast<double>(count)};
  }
  Compare(figures, "14_slam_stereo_tracks");
}

}  // namespace
}  // namespace alidade
