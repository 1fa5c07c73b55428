// SPDX-License-Identifier: Apache-2.0
//
// Measures the accuracy of the depth filter on real series. Compares the filter with stereo alone,
// the last value and the line d = c s. Tunes the parameters on every second series, and reports
// results for the other series:
//
//   accuracy_depth_pairs examples/07_depth_pairs/config.yaml FOLDER_OF_SERIES
//
// docs/experiments.md, "Real series of depth", states the tuned parameters, the series, the
// criterion and the columns. The exit code is 1 if a tuned parameter is at the edge of its grid.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/sweep/sweep.h"
#include "bench/accuracy/bootstrap.h"
#include "bench/accuracy/pair_series.h"
#include "bench/accuracy/read_pair_series.h"

namespace {

using alidade::bench::PairSeries;
using Settings = std::vector<std::pair<std::string, std::string>>;
using Names = std::vector<std::string>;
using RmseByEstimator = std::map<std::string, double>;

/// Parameter of a grid search, with its values in ascending order.
struct Axis {
  std::string key;
  Names values;
};

const std::vector<Axis> kFusedGrid = {{"state.target.noise.acceleration",
                                       {"0.5", "0.7", "1", "1.4", "2", "3", "4", "6", "8", "12",
                                        "16", "24", "32", "64", "128", "256", "512", "1024"}},
                                      {"state.template.noise.random_walk",
                                       {"0", "0.00025", "0.00035", "0.0005", "0.0007", "0.001",
                                        "0.0014", "0.002", "0.0028", "0.004"}}};
const std::vector<Axis> kStereoGrid = {
    {"estimators.stereo_only.overrides.state.target.noise.acceleration",
     {"0.05", "0.1", "0.2", "0.3", "0.4", "0.6", "0.8", "1", "1.4", "2", "3", "4", "6", "8", "12",
      "16", "32"}},
    {"estimators.stereo_only.overrides.sensors.stereo.sigma_px",
     {"0.025", "0.05", "0.1", "0.2", "0.4", "0.8", "1.6", "3.2"}}};
// Lags for which the drift of the scale is printed.
constexpr double kShownLagsS[] = {0.1, 0.4, 0.8, 1.2};

/// Program arguments and common data of all runs.
struct Bench {
  std::string config_file;
  const alidade::PluginHost& host;

  alidade::Experiment Make(const std::string& series, const Settings& settings, bool masked) const {
    alidade::Config config = alidade::Config::FromFile(config_file);
    for (const auto& [key, value] : settings) config.Set(key, value, "--set");
    config.Set("source.path", series, "--set");
    config.Set("source.blind_after", masked ? "0.5" : "1.0", "--set");
    return alidade::BuildExperiment(config, host);
  }

  /// Returns the RMSE of the depth of each estimator. If `masked` is true, the RMSE is that of the
  /// blind half of the series. Otherwise it is that of the whole series.
  RmseByEstimator Rmse(const std::string& series, const Settings& settings, bool masked) const {
    alidade::Experiment experiment = Make(series, settings, masked);
    RmseByEstimator rmse;
    for (const auto& result : alidade::Run(experiment, {}).estimators) {
      rmse[result.name] =
          result.metrics.at(masked ? "rmse:target.depth@blind" : "rmse:target.depth");
    }
    return rmse;
  }

  /// Returns the data of the masked run, including the calibration from the header of the series.
  PairSeries Read(const std::string& file) const {
    const alidade::Experiment experiment = Make(file, {}, true);
    return alidade::bench::ReadPairSeries(*experiment.source, std::filesystem::path(file).stem());
  }
};

/// Calls `visit` with every combination of the values of the axes.
void ForEach(const std::vector<Axis>& grid, Settings& settings,
             const std::function<void(const Settings&)>& visit) {
  if (settings.size() == grid.size()) return visit(settings);
  const Axis& axis = grid[settings.size()];
  for (const std::string& value : axis.values) {
    settings.emplace_back(axis.key, value);
    ForEach(grid, settings, visit);
    settings.pop_back();
  }
}

struct Choice {
  Settings settings;
  double geometric_mean = INFINITY;
  bool at_edge = false;
};

Choice Choose(const Bench& bench, const std::string& estimator, const std::vector<Axis>& grid,
              const Names& series) {
  Choice best;
  Settings start;
  ForEach(grid, start, [&](const Settings& settings) {
    double sum = 0.0;
    for (const std::string& file : series) {
      sum += std::log(bench.Rmse(file, settings, true).at(estimator));
    }
    const double mean = std::exp(sum / static_cast<double>(series.size()));
    if (mean < best.geometric_mean) best = {settings, mean};
  });
  std::printf("%s: geometric mean of the RMSE %.3f m, over %zu series\n", estimator.c_str(),
              best.geometric_mean, series.size());
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const Names& values = grid[i].values;
    const std::string& value = best.settings[i].second;
    const bool at_edge = value == values.front() || value == values.back();
    best.at_edge |= at_edge;
    std::printf("  %s = %s, grid from %s to %s%s\n", grid[i].key.c_str(), value.c_str(),
                values.front().c_str(), values.back().c_str(), at_edge ? ": AT THE EDGE" : "");
  }
  return best;
}

/// Returns the settings of the fused filter and of stereo alone that minimise the RMSE on the given
/// series.
Choice ChooseAll(const Bench& bench, const Names& series) {
  Choice choice = Choose(bench, "fused", kFusedGrid, series);
  const Choice stereo = Choose(bench, "stereo_only", kStereoGrid, series);
  choice.settings.insert(choice.settings.end(), stereo.settings.begin(), stereo.settings.end());
  choice.at_edge |= stereo.at_edge;
  return choice;
}

/// Table that is printed row by row. Medians() prints the last row.
class Table {
 public:
  explicit Table(Names columns) : columns_(std::move(columns)), values_(columns_.size()) {
    std::printf("\n| series |");
    for (const std::string& column : columns_) std::printf(" %s |", column.c_str());
    std::printf("\n|---|");
    for (std::size_t i = 0; i < columns_.size(); ++i) std::printf("---|");
    std::printf("\n");
  }
  void Add(const std::string& name, const std::vector<double>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) values_[i].push_back(row[i]);
    Print(name, row);
  }
  void Medians() const {
    std::vector<double> row;
    for (const auto& column : values_) row.push_back(alidade::Median(column));
    Print("median", row);
  }

 private:
  static void Print(const std::string& name, const std::vector<double>& row) {
    std::printf("| %s |", name.c_str());
    for (const double value : row) std::printf(" %.3f |", value);
    std::printf("\n");
  }
  Names columns_;
  std::vector<std::vector<double>> values_;
};

/// Prints the RMSE of the estimators and the baselines for each series. Returns log(RMSE of fused /
/// RMSE of the line) of each masked series.
std::vector<double> Report(const char* title, const Bench& bench, const Settings& settings,
                           const Names& files) {
  std::printf("\n%s:\n", title);
  Table table({"masked: fused", "line", "stereo_only", "hold_last", "known at masking",
               "best constant", "whole: fused", "stereo_only"});
  std::vector<double> differences;
  for (const std::string& file : files) {
    const RmseByEstimator masked = bench.Rmse(file, settings, true);
    const RmseByEstimator unmasked = bench.Rmse(file, settings, false);
    const PairSeries series = bench.Read(file);
    const double fused = masked.at("fused"), line = LineRmse(series);
    table.Add(series.name,
              {fused, line, masked.at("stereo_only"), masked.at("hold_last"), AnchoredRmse(series),
               BestConstantRmse(series), unmasked.at("fused"), unmasked.at("stereo_only")});
    differences.push_back(std::log(fused / line));
  }
  table.Medians();
  return differences;
}

void PrintDifference(const char* title, const std::vector<double>& differences) {
  const alidade::Interval interval = alidade::bench::BootstrapOfMean(differences);
  std::printf("%s: mean of log(fused / line) over %zu series %+.3f, 95 %% [%+.3f, %+.3f]\n", title,
              differences.size(), alidade::Mean(differences), interval.low, interval.high);
}

/// Prints the standard deviation of the white noise of both sensors, and the drift of the scale.
void ReportNoise(const Bench& bench, const Names& files) {
  double disparity = 0.0, log_scale = 0.0;
  std::printf("\nrms growth of log(s Z) in %%, for several lags:\n");
  Names columns;
  for (const double lag_s : kShownLagsS)
    columns.push_back(std::to_string(lag_s).substr(0, 3) + " s");
  Table table(columns);
  for (const std::string& file : files) {
    const PairSeries series = bench.Read(file);
    disparity += WhiteVariance(series, [](const auto& row) { return row.disparity_px; });
    log_scale += WhiteVariance(series, [](const auto& row) { return std::log(row.scale); });
    const double interval_s = (series.rows.back().t_s - series.rows.front().t_s) /
                              static_cast<double>(series.rows.size() - 1);
    std::vector<double> growth;
    for (const double lag_s : kShownLagsS) {
      const auto lag = static_cast<std::size_t>(std::lround(lag_s / interval_s));
      growth.push_back(100.0 * std::sqrt(DriftVariance(series, lag)));
    }
    table.Add(series.name, growth);
  }
  table.Medians();
  const auto n = static_cast<double>(files.size());
  std::printf("white noise: disparity %.3f px, log(scale) %.5f\n", std::sqrt(disparity / n),
              std::sqrt(log_scale / n));
}

int Main(const std::string& config, const std::string& folder) {
  Names files, tuning, reported;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (std::size_t i = 0; i < files.size(); ++i)
    (i % 2 == 0 ? tuning : reported).push_back(files[i]);
  const alidade::PluginHost host;
  const Bench bench{config, host};

  ReportNoise(bench, tuning);
  std::printf("\n");
  const Choice choice = ChooseAll(bench, tuning);
  std::vector<double> differences = Report("reported series", bench, choice.settings, reported);
  PrintDifference("reported series", differences);
  Report("series used for tuning", bench, choice.settings, tuning);

  std::printf("\nexchanged halves:\n");
  const Choice exchanged = ChooseAll(bench, reported);
  const std::vector<double> exchanged_differences =
      Report("reported series", bench, exchanged.settings, tuning);
  differences.insert(differences.end(), exchanged_differences.begin(), exchanged_differences.end());
  PrintDifference("all series, each with the settings of the other half", differences);
  return choice.at_edge ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s CONFIG FOLDER_OF_SERIES\n", argv[0]);
    return 2;
  }
  try {
    return Main(argv[1], argv[2]);
  } catch (const alidade::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return static_cast<int>(error.code());
  }
}
