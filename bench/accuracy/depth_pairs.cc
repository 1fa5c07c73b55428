// SPDX-License-Identifier: Apache-2.0
//
// Chooses the noise of the real depth filter on every second series and reports it on the others,
// and then on those too:
//
//   accuracy_depth_pairs examples/07_depth_pairs/config.yaml FOLDER_OF_SERIES
//
// The same grid serves the stereo-only baseline, which chooses for itself. What is minimised is the
// geometric mean, over the tuning series, of the depth RMSE while stereo is masked (second half).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "alidade/run/run.h"
#include "alidade/sweep/sweep.h"

namespace {

using Settings = std::vector<std::pair<std::string, std::string>>;
using Names = std::vector<std::string>;

constexpr const char* kAcceleration = "state.target.noise.acceleration";
constexpr const char* kDisparity = "sensors.stereo.sigma_px";
constexpr const char* kWalk = "state.template.noise.random_walk";
constexpr const char* kScale = "sensors.scale.sigma_px";
constexpr const char* kBaseline =
    "estimators.stereo_only.overrides.state.target.noise.acceleration";
constexpr const char* kBaselineSigma = "estimators.stereo_only.overrides.sensors.stereo.sigma_px";

/// RMSE of depth by estimator: masked, in the blind half; unmasked, over the whole series.
std::map<std::string, double> Rmse(const std::string& config_file, const Settings& settings,
                                   const std::string& series, bool masked,
                                   const alidade::PluginHost& host) {
  alidade::Config config = alidade::Config::FromFile(config_file);
  for (const auto& [key, value] : settings) config.Set(key, value, "--set");
  config.Set("source.path", series, "--set");
  config.Set("source.blind_after", masked ? "0.5" : "1.0", "--set");
  alidade::Experiment experiment = alidade::BuildExperiment(config, host);
  std::map<std::string, double> rmse;
  for (const auto& result : alidade::Run(experiment, {}).estimators) {
    rmse[result.name] = result.metrics.at(masked ? "rmse:target.depth@blind" : "rmse:target.depth");
  }
  return rmse;
}

struct Choice {
  Settings settings;
  double geometric_mean = INFINITY;
};

Choice Choose(const std::string& config, const std::string& estimator,
              const std::vector<Settings>& grid, const Names& series,
              const alidade::PluginHost& host) {
  Choice best;
  for (const Settings& settings : grid) {
    double sum = 0.0;
    for (const std::string& file : series) {
      sum += std::log(Rmse(config, settings, file, true, host).at(estimator));
    }
    const double mean = std::exp(sum / static_cast<double>(series.size()));
    if (mean < best.geometric_mean) best = {settings, mean};
  }
  std::printf("%s, geometric mean %.3f m on %zu series:\n", estimator.c_str(), best.geometric_mean,
              series.size());
  for (const auto& [key, value] : best.settings) {
    std::printf("  %s = %s\n", key.c_str(), value.c_str());
  }
  return best;
}

double Median(std::vector<double> values) {
  std::ranges::sort(values);
  return alidade::Quantile(values, 0.5);
}

double Mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

void Report(const char* title, const std::string& config, const Settings& settings,
            const Names& series, const alidade::PluginHost& host) {
  const Names estimators = {"fused", "stereo_only", "hold_last"};
  std::printf("\n%s:\n", title);
  std::printf(
      "\n| series | masked: fused | stereo_only | hold_last | whole: fused | stereo_only |\n"
      "|---|---|---|---|---|---|\n");
  std::map<std::string, std::vector<double>> masked, whole;
  for (const std::string& file : series) {
    const auto m = Rmse(config, settings, file, true, host);
    const auto w = Rmse(config, settings, file, false, host);
    for (const std::string& name : estimators) {
      masked[name].push_back(m.at(name));
      whole[name].push_back(w.at(name));
    }
    std::printf("| %s | %.3f | %.3f | %.3f | %.3f | %.3f |\n",
                std::filesystem::path(file).stem().c_str(), m.at("fused"), m.at("stereo_only"),
                m.at("hold_last"), w.at("fused"), w.at("stereo_only"));
  }
  std::printf("| median masked, mean whole | %.3f | %.3f | %.3f | %.3f | %.3f |\n",
              Median(masked["fused"]), Median(masked["stereo_only"]), Median(masked["hold_last"]),
              Mean(whole["fused"]), Mean(whole["stereo_only"]));
}

int Main(const std::string& config, const std::string& folder) {
  Names tuning, reporting;
  Names files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size(); ++i) {
    (i % 2 == 0 ? tuning : reporting).push_back(files[i]);
  }
  std::vector<Settings> fused_grid, baseline_grid;
  for (const char* acceleration : {"0.3", "1", "3", "10"}) {
    for (const char* disparity : {"0.05", "0.1", "0.2", "0.4"}) {
      baseline_grid.push_back({{kBaseline, acceleration}, {kBaselineSigma, disparity}});
      for (const char* walk : {"0", "0.0003", "0.001", "0.002"}) {
        for (const char* scale : {"0.15", "0.3", "0.75", "1.5"}) {
          fused_grid.push_back({{kAcceleration, acceleration},
                                {kDisparity, disparity},
                                {kWalk, walk},
                                {kScale, scale}});
        }
      }
    }
  }
  const alidade::PluginHost host;
  Settings settings = Choose(config, "fused", fused_grid, tuning, host).settings;
  const Choice baseline = Choose(config, "stereo_only", baseline_grid, tuning, host);
  settings.insert(settings.end(), baseline.settings.begin(), baseline.settings.end());
  Report("reported", config, settings, reporting, host);
  Report("tuned on", config, settings, tuning, host);
  return 0;
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
