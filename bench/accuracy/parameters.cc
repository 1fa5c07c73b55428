// SPDX-License-Identifier: Apache-2.0
//
// Measures the false alarms and the detections of `alidade diagnose --why`:
//
//   accuracy_parameters examples [SEEDS [SEEDS_OF_FAULTS]]
//
// Tests the parameters of consistent filters with the seeds 4001, 4002, ... Then plants one wrong
// parameter in each run, with the seeds 3001, 3002, ..., and counts the runs in which its test is
// an alarm, and is the first one or an alternative to the first one. Prints both tables of
// docs/diagnose.md. Defaults: 50 and 20 seeds. The exit code is 1 if a consistent filter raises an
// alarm.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/experiment/parameter_tests.h"

namespace {

namespace fs = std::filesystem;
using alidade::ParameterTest;
using Settings = std::vector<std::string>;

/// Filter whose parameters are tested. The settings make it consistent.
struct Case {
  std::string example, folder, estimator;
  Settings settings;
};

const Case kDepth = {
    "05",
    "05_depth_principled",
    "ekf",
    {"source={type: models, rate_hz: 30, duration_s: 5}", "sensors.stereo.focal_px=2000",
     "state.target.initial.depth={mean: 5, sigma: 0.02}",
     "state.target.initial.depth_rate={mean: 0.3, sigma: 0.1}",
     "state.template.initial.inverse_distance={mean: 0.2, sigma: 0.002}"}};
/// Example 24 with the right clock of the camera, which the estimator `ignored` assumes to be 0.
const Case kPose = {
    "24", "24_time_offset", "ignored", {"source.initial={}", "sensors.camera.time_offset_s=0"}};

/// Value of a parameter of the simulated truth, which differs from that of the filter.
struct Fault {
  std::string text;
  const Case& filter;
  std::string overrides;  ///< of the source
  std::string key;
  double value;
};

const Fault kFaults[] = {
    {"clock of the camera off by 20 ms", kPose, "{sensors: {camera: {time_offset_s: 0.02}}}",
     "sensors.camera.time_offset_s", 0.02},
    {"clock of the camera off by 5 ms", kPose, "{sensors: {camera: {time_offset_s: 0.005}}}",
     "sensors.camera.time_offset_s", 0.005},
    {"clock of the camera off by 2 ms", kPose, "{sensors: {camera: {time_offset_s: 0.002}}}",
     "sensors.camera.time_offset_s", 0.002},
    {"clock of the camera off by 1 ms", kPose, "{sensors: {camera: {time_offset_s: 0.001}}}",
     "sensors.camera.time_offset_s", 0.001},
    {"sigma of the mocap position x 1.5", kPose, "{sensors: {mocap: {sigma_position_m: 0.015}}}",
     "sensors.mocap.sigma_position_m", 0.015},
    {"angular acceleration x 1.5", kPose,
     "{state: {body: {noise: {kind: continuous, linear_acceleration: 1, angular_acceleration: "
     "1.5}}}}",
     "state.body.noise.angular_acceleration", 1.5},
    {"sigma of the stereo sensor x 1.5", kDepth, "{sensors: {stereo: {sigma_px: 1.5}}}",
     "sensors.stereo.sigma_px", 1.5},
    {"acceleration x 3", kDepth, "{state: {target: {noise: {acceleration: 3}}}}",
     "state.target.noise.acceleration", 3.0},
    {"acceleration / 3", kDepth, "{state: {target: {noise: {acceleration: 0.333}}}}",
     "state.target.noise.acceleration", 0.333},
};

class Bench {
 public:
  explicit Bench(fs::path examples)
      : examples_(std::move(examples)), host_(std::vector<fs::path>{}) {}

  /// Prints the row of a consistent filter. Returns the number of runs with an alarm.
  int ReportClean(const Case& filter, int seeds) {
    int alarms = 0;
    double largest = 0.0, squares = 0.0, count = 0.0;
    for (int i = 0; i < seeds; ++i) {
      const std::vector<ParameterTest> tests = Test(filter, "{}", 4001 + i);
      alarms += tests.front().is_alarm() ? 1 : 0;
      largest = std::max(largest, std::abs(tests.front().z));
      for (const ParameterTest& test : tests) {
        if (!test.not_tested.empty()) continue;
        squares += test.z * test.z;
        ++count;
      }
    }
    std::printf("| %s | %s | %d | %.0f | %d | %.1f | %.2f |\n", filter.example.c_str(),
                filter.estimator.c_str(), seeds, count / seeds, alarms, largest,
                std::sqrt(squares / count));
    std::fflush(stdout);
    return alarms;
  }

  void ReportFault(const Fault& fault, int seeds) {
    int alarms = 0, named = 0;
    double sum = 0.0, squares = 0.0;
    for (int i = 0; i < seeds; ++i) {
      const std::vector<ParameterTest> tests = Test(fault.filter, fault.overrides, 3001 + i);
      alarms += tests.front().is_alarm() ? 1 : 0;
      const ParameterTest& wrong = *std::ranges::find(tests, fault.key, &ParameterTest::key);
      const std::string& first = tests.front().key;
      named += wrong.is_alarm() && (wrong.key == first || wrong.alternative_to == first) ? 1 : 0;
      const double estimate = wrong.better;
      sum += estimate;
      squares += estimate * estimate;
    }
    const double mean = sum / seeds;
    std::printf("| %s | %s | %d/%d | %d/%d | %g | %.3g +- %.2g |\n", fault.text.c_str(),
                fault.filter.example.c_str(), alarms, seeds, named, seeds, fault.value, mean,
                std::sqrt(std::max(0.0, squares / seeds - mean * mean)));
    std::fflush(stdout);
  }

 private:
  std::vector<ParameterTest> Test(const Case& filter, const std::string& overrides, int seed) {
    alidade::Config config = alidade::Config::FromFile(examples_ / filter.folder / "config.yaml");
    const auto set = [&](const std::string& key, const std::string& value) {
      config.Set(key, value, "bench");
    };
    for (const std::string& setting : filter.settings) {
      const std::size_t equals = setting.find('=');
      set(setting.substr(0, equals), setting.substr(equals + 1));
    }
    set("source.overrides", overrides);
    set("source.seed", std::to_string(seed));
    return alidade::TestParameters(config, host_, filter.estimator, {}).parameters;
  }

  fs::path examples_;
  alidade::PluginHost host_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: accuracy_parameters EXAMPLES [SEEDS [SEEDS_OF_FAULTS]]\n");
    return 2;
  }
  Bench bench(argv[1]);
  const int seeds = argc > 2 ? std::stoi(argv[2]) : 50, faults = argc > 3 ? std::stoi(argv[3]) : 20;
  std::printf("| example | estimator | runs | parameters | alarms | largest \\|z\\| | rms z |\n");
  std::printf("|---|---|---:|---:|---:|---:|---:|\n");
  const int alarms = bench.ReportClean(kDepth, seeds) + bench.ReportClean(kPose, seeds);
  std::printf("\n| fault | example | alarm | named | truth | estimate |\n");
  std::printf("|---|---|---:|---:|---:|---:|\n");
  for (const Fault& fault : kFaults) bench.ReportFault(fault, faults);
  return alarms == 0 ? 0 : 1;
}
