// SPDX-License-Identifier: Apache-2.0
//
// Measures the false alarms and the detections of `alidade diagnose`:
//
//   accuracy_diagnosis examples [SEEDS]
//
// Runs seven clean examples with the seeds 2001, 2002, ... and counts the runs with a finding or
// with another verdict than `consistent`. Then runs examples with one planted fault each, with the
// seeds 3001, 3002, ... and counts the runs in which one of the first three findings, or an event,
// names the fault. Prints both tables of docs/diagnose.md. SEEDS is the number of seeds; default
// 20. The exit code is 1 if more than 1 % of the clean runs raise an alarm, or if fewer than 24
// faults are named in three of four runs.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "alidade/base/text.h"
#include "alidade/experiment/run.h"

namespace {

namespace fs = std::filesystem;
using Settings = std::vector<std::string>;
using Names = std::vector<std::string>;

const std::map<std::string, std::string> kExamples = {
    {"05", "05_depth_principled"}, {"07", "07_depth_pairs"}, {"08", "08_depth_all_estimators"},
    {"10", "10_slam_scene"},       {"21", "21_poses"},       {"22", "22_range_bearing"},
    {"23", "23_satellites"},       {"24", "24_time_offset"},
};

/// Clean run: an example and an estimator of this example.
struct Case {
  std::string example, estimator;
};
const std::vector<Case> kClean = {{"05", "ekf"}, {"08", "iekf"},     {"10", "ekf"},
                                  {"21", "ekf"}, {"21", "ukf"},      {"22", "ekf"},
                                  {"23", "ekf"}, {"24", "estimated"}};

/// Fault that is planted by settings of a config.
struct Fault {
  std::string text;
  Case run;
  Settings settings;
  Names names;  ///< findings and events that name the fault
};

/// Simulates measurements by the models of the config, with a correct prior.
Settings FromModels(Settings settings) {
  const Settings common = {"source={type: models, rate_hz: 30, duration_s: 5}",
                           "sensors.stereo.focal_px=2000",
                           "state.target.initial.depth={mean: 5, sigma: 0.02}",
                           "state.target.initial.depth_rate={mean: 0, sigma: 0.1}",
                           "state.template.initial.inverse_distance={mean: 0.2, sigma: 0.002}"};
  settings.insert(settings.begin(), common.begin(), common.end());
  return settings;
}

const Settings kWrongPrior = {
    "state.body.initial.position={mean: [0, 0, 0], sigma: 0.01}",
    "source.overrides={state: {body: {initial: {position: {mean: [3, 0, 0], sigma: 0.2}}}}}"};

Settings With(Settings settings, const std::string& setting) {
  settings.push_back(setting);
  return settings;
}

std::vector<Fault> DepthFaults() {
  const Case run = {"05", "ekf"};
  const Names scale = {"correlated", "overconfident", "rejected"};
  return {
      {"stereo sigma 2 times too small", run, {"sensors.stereo.sigma_px=0.5"}, {"overconfident"}},
      {"stereo sigma 3 times too large", run, {"sensors.stereo.sigma_px=3"}, {"underconfident"}},
      {"acceleration 10 times too small", run, {"state.target.noise.acceleration=0.1"}, scale},
      {"acceleration 10 times too large",
       run,
       {"state.target.noise.acceleration=10"},
       {"anticorrelated", "underconfident"}},
      {"acceleration 10 times too small, source `models`", run,
       FromModels({"source.overrides={state: {target: {noise: {acceleration: 10}}}}"}), scale},
      {"5 % of the disparities are arbitrary",
       run,
       {"source.outliers.share=0.05", "estimators.ekf.gate=none"},
       {"heavy_tails"}},
      {"5 % outliers of 20 sigma, source `models`",
       run,
       FromModels({"source.sensors={stereo: {outliers: {share: 0.05, sigma_scale: 20}}}",
                   "estimators.ekf.gate=none"}),
       {"heavy_tails"}},
      {"focal length 5 % too large",
       run,
       {"sensors.stereo.focal_px=420"},
       {"bias", "correlated", "overconfident"}},
      {"baseline in mm", run, {"sensors.stereo.baseline_m=65"}, {"unit", "prior_far", "rejected"}},
      {"baseline in mm, prior of 5 cm",
       run,
       {"sensors.stereo.baseline_m=65", "state.target.initial.depth.sigma=0.05"},
       {"unit"}},
      {"prior wrong by 50 sigma",
       run,
       {"state.target.initial.depth={mean: 0.6, sigma: 0.005}"},
       {"prior_far", "out_of_domain"}},
      {"scale without stereo", run, {"estimators.ekf.sensors=[scale]"}, {"unobservable"}},
      {"constant noise of the scale, truth cubic",
       run,
       {"sensors.scale={model: scale_2d, stream: inverse_scale, roles: {depth: target.depth, "
        "inverse_distance: template.inverse_distance}, noise_model: constant, "
        "sigma_inverse_scale: 0.0067}"},
       {"heteroscedastic"}},
  };
}

std::vector<Fault> OtherFaults() {
  const std::string camera = "source.initial.camera.time_offset=";
  return {
      {"pixel sigma 2 times too small",
       {"10", "ekf"},
       {"sensors.pixels.sigma_px=0.5"},
       {"overconfident"}},
      {"pixel sigma 2 times too large",
       {"10", "ekf"},
       {"sensors.pixels.sigma_px=2"},
       {"underconfident"}},
      {"linear acceleration 10 times too small",
       {"10", "ekf"},
       {"state.cam.noise.linear_acceleration=0.03"},
       {"correlated", "overconfident"}},
      {"bearing noise 3 times too small",
       {"22", "ekf"},
       {"source.overrides={sensors: {laser: {sigma_bearing_rad: 0.03}}}"},
       {"overconfident", "element"}},
      {"sigma of the orientation in degrees",
       {"21", "ekf"},
       {"sensors.mocap.sigma_orientation_rad=1.15",
        "source.overrides={sensors: {mocap: {sigma_orientation_rad: 0.02}}}"},
       {"element", "underconfident"}},
      {"prior wrong by 3 m, no recovery",
       {"21", "ekf"},
       With(kWrongPrior,
            "estimators.ekf={type: ekf, gate: 0.99, rejection_recovery: {after: 20, action: "
            "none}}"),
       {"prior_far", "rejected"}},
      {"prior wrong by 3 m, recovery",
       {"21", "ekf"},
       With(kWrongPrior, "estimators.ekf={type: ekf, gate: 0.99}"),
       {"prior_far", "rejection_recovery"}},
      {"clock of the camera off by 20 ms", {"24", "ignored"}, {}, {"time_offset"}},
      {"clock of the camera off by 5 ms", {"24", "ignored"}, {camera + "0.005"}, {"time_offset"}},
      {"clock of the camera off by 2 ms", {"24", "ignored"}, {camera + "0.002"}, {"time_offset"}},
      {"clock walks 10 times as fast",
       {"23", "ekf"},
       {"source.overrides={sensors: {gnss: {dynamics: {clock_bias: {random_walk: 20}}}}}"},
       {"correlated", "overconfident"}},
      {"noise of pseudoranges 6 m, sigma 3 m",
       {"23", "ekf"},
       {"source.overrides={sensors: {gnss: {sigma_m: 6}}}"},
       {"overconfident"}},
      {"noise of 1 um and prior of 1e6 m",
       {"23", "ekf"},
       {"sensors.gnss.sigma_m=1.0e-6",
        "sensors.gnss.initial={clock_bias: {mean: 0, sigma: 1.0e6}}"},
       {"digits_lost"}},
  };
}

/// Copies a table and changes the cells of one column.
class ChangedTable {
 public:
  ChangedTable(const fs::path& source, fs::path folder)
      : source_(source), folder_(std::move(folder)) {}

  /// Returns the setting that selects the changed table.
  std::string With(const std::string& column, const std::function<double(double)>& change) const {
    const fs::path file = folder_ / (std::to_string(count_++) + ".csv");
    std::ifstream input(source_);
    std::ofstream output(file);
    std::size_t index = std::string::npos;
    for (std::string line; std::getline(input, line);) {
      std::vector<std::string> cells = Cells(line);
      if (line.starts_with('#') || line.empty()) {
        cells = {line};
      } else if (index == std::string::npos) {
        index = static_cast<std::size_t>(std::ranges::find(cells, column) - cells.begin());
      } else if (!cells.at(index).empty() && cells[index] != "nan") {
        cells[index] = std::to_string(change(std::stod(cells[index])));
      }
      output << alidade::internal::Join(cells, ",") << '\n';
    }
    return "source.path=" + file.string();
  }

 private:
  static std::vector<std::string> Cells(const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    if (line.ends_with(',')) cells.emplace_back();
    return cells;
  }

  fs::path source_, folder_;
  mutable int count_ = 0;
};

std::vector<Fault> TableFaults(const ChangedTable& table) {
  const Case run = {"07", "fused"};
  std::mt19937 random(1);
  const auto spike = [&](double value) { return random() % 100 < 8 ? 1.5 * value : value; };
  return {
      {"times in ms", run, {table.With("t_s", [](double t) { return 1000.0 * t; })}, {"time_unit"}},
      {"disparity in 1/16 px",
       run,
       {table.With("disparity_px", [](double d) { return 16.0 * d; })},
       {"unit", "prior_far"}},
      {"8 % of the scales 1.5 times too large", run, {table.With("scale", spike)}, {"heavy_tails"}},
      {"disparity too large by 3 px",
       run,
       {table.With("disparity_px", [](double d) { return d + 3.0; })},
       {"bias"}},
  };
}

class Bench {
 public:
  Bench(fs::path examples, int seeds)
      : examples_(std::move(examples)), seeds_(seeds), host_(std::vector<fs::path>{}) {}

  /// Prints the table of clean runs. Returns the share of runs with an alarm.
  double ReportClean() {
    std::printf("| example | estimator | runs | with a finding | not consistent |\n");
    std::printf("|---|---|---:|---:|---:|\n");
    int alarms = 0;
    for (const Case& run : kClean) {
      int found = 0, inconsistent = 0;
      for (int i = 0; i < seeds_; ++i) {
        const alidade::EstimatorResult result = Run(run, {}, 2001 + i);
        const bool is_consistent = result.verdict.state == alidade::VerdictState::kConsistent;
        found += result.findings.empty() ? 0 : 1;
        inconsistent += is_consistent ? 0 : 1;
        alarms += result.findings.empty() && is_consistent ? 0 : 1;
        for (const alidade::Finding& finding : result.findings) {
          std::fprintf(stderr, "%s %s %d: %s\n", run.example.c_str(), run.estimator.c_str(),
                       2001 + i, finding.text.c_str());
        }
        if (!is_consistent) {
          std::fprintf(stderr, "%s %s %d: %s, %s\n", run.example.c_str(), run.estimator.c_str(),
                       2001 + i, ToString(result.verdict.state), result.verdict.because.c_str());
        }
      }
      std::printf("| %s | %s | %d | %d | %d |\n", run.example.c_str(), run.estimator.c_str(),
                  seeds_, found, inconsistent);
      std::fflush(stdout);
    }
    return alarms / static_cast<double>(seeds_ * static_cast<int>(kClean.size()));
  }

  /// Prints the table of planted faults. Returns the number of faults that were named in three of
  /// four runs.
  int ReportFaults(const std::vector<Fault>& faults) {
    std::printf(
        "\n| fault | example | named by | named | any finding |\n|---|---|---|---:|---:|\n");
    int named_faults = 0;
    for (const Fault& fault : faults) {
      const int runs = fault.run.example == "07" ? 1 : seeds_;  // a table has no seed
      int named = 0, any = 0;
      for (int i = 0; i < runs; ++i) {
        const alidade::EstimatorResult result = Run(fault.run, fault.settings, 3001 + i);
        named += IsNamed(result, fault.names) ? 1 : 0;
        any += result.findings.empty() ? 0 : 1;
      }
      named_faults += 4 * named >= 3 * runs ? 1 : 0;
      std::printf("| %s | %s | %s | %d/%d | %d/%d |\n", fault.text.c_str(),
                  fault.run.example.c_str(), alidade::internal::Join(fault.names, ", ").c_str(),
                  named, runs, any, runs);
      std::fflush(stdout);
    }
    std::printf("\n%d of %zu faults are named.\n", named_faults, faults.size());
    return named_faults;
  }

  fs::path example(const std::string& number) const { return examples_ / kExamples.at(number); }

 private:
  /// Runs one estimator of an example. Seed 0 means that the source has no seed.
  alidade::EstimatorResult Run(const Case& run, const Settings& settings, int seed) {
    alidade::Config config = alidade::Config::FromFile(example(run.example) / "config.yaml");
    if (run.example != "07") config.Set("source.seed", std::to_string(seed), "bench");
    for (const std::string& setting : settings) {
      const std::size_t equals = setting.find('=');
      config.Set(setting.substr(0, equals), setting.substr(equals + 1), "bench");
      // A replaced source has no seed.
      if (setting.starts_with("source={")) config.Set("source.seed", std::to_string(seed), "bench");
    }
    alidade::Experiment experiment = alidade::BuildExperiment(config, host_);
    if (experiment.reference < 0) {
      std::erase_if(experiment.estimators,
                    [&](const alidade::EstimatorSpec& spec) { return spec.name != run.estimator; });
    }
    alidade::RunResult result = alidade::Run(experiment, {});
    return *std::ranges::find(result.estimators, run.estimator, &alidade::EstimatorResult::name);
  }

  static bool IsNamed(const alidade::EstimatorResult& result, const Names& names) {
    constexpr std::size_t kFirst = 3;
    std::set<std::string> reported;
    for (std::size_t i = 0; i < std::min(kFirst, result.findings.size()); ++i) {
      reported.insert(ToString(result.findings[i].kind));
    }
    for (const alidade::Event& event : result.events) reported.insert(ToString(event.kind));
    if (!result.unobservable.empty()) reported.insert("unobservable");
    return std::ranges::any_of(names,
                               [&](const std::string& name) { return reported.contains(name); });
  }

  fs::path examples_;
  int seeds_;
  alidade::PluginHost host_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: accuracy_diagnosis EXAMPLES [SEEDS]\n");
    return 2;
  }
  Bench bench(argv[1], argc > 2 ? std::stoi(argv[2]) : 20);
  const fs::path folder = fs::temp_directory_path() / "accuracy_diagnosis";
  fs::create_directories(folder);
  const double alarms = bench.ReportClean();
  std::vector<Fault> faults = DepthFaults();
  const std::vector<Fault> lists[] = {
      OtherFaults(), TableFaults(ChangedTable(bench.example("07") / "approach.csv", folder))};
  for (const std::vector<Fault>& list : lists)
    faults.insert(faults.end(), list.begin(), list.end());
  const int named = bench.ReportFaults(faults);
  fs::remove_all(folder);
  return alarms <= 0.01 && named >= 24 ? 0 : 1;
}
