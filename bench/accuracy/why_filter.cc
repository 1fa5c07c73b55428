// SPDX-License-Identifier: Apache-2.0
//
// Compares the accuracy and the cost of a filter and of the batch in the way of [Strasdat2012]: on
// the same trajectory, with different numbers of points and frames. "The smallest filter" has the
// smallest numbers of points and frames.
//
//   accuracy_why_filter examples/10_slam_scene/sweep_batch.yaml FOLDER [SEEDS]
//
// This command runs the seeds 1001, 1002, ... It writes FOLDER/why_filter.csv with the columns
//
//   rmse_m    sqrt(mean |e|^2) of the position at the last frame, m
//   bits      mean of E = 1/2 log2(det C_0 / det C), with the 6 x 6 covariance C of the last pose,
//             and C_0 of the smallest filter
//   cpu       median time of the whole trajectory, relative to the smallest filter
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "bench/speed/interleaved.h"

namespace {

constexpr int kAllFrames = 150;      // frames of the whole trajectory
constexpr double kAllRateHz = 30.0;  // frame rate with kAllFrames
const std::vector<int> kFrames = {10, 19, 38, 75, kAllFrames};
const std::vector<int> kPoints = {10, 20, 40, 80};
const std::vector<std::string> kEstimators = {"ekf", "batch"};

/// Result of one run of one estimator.
struct Outcome {
  bool is_valid = false;  ///< true if the run neither failed nor diverged
  double error_m = 0.0, log2_det = 0.0, cpu_ns = 0.0;
};

/// Returns log2(det C) of the covariance C of position and orientation.
double Log2Det(const alidade::State& state) {
  const alidade::StateLayout& layout = state.layout();
  const int p = layout[layout.Find("cam.position")].tangent_offset;
  const int q = layout[layout.Find("cam.orientation")].tangent_offset;
  Eigen::MatrixXd c(6, 6);
  c << state.covariance().Block(p, 3, p, 3), state.covariance().Block(p, 3, q, 3),
      state.covariance().Block(q, 3, p, 3), state.covariance().Block(q, 3, q, 3);
  return 2.0 * c.llt().matrixLLT().diagonal().array().log2().sum();
}

/// Returns the config with the given numbers of points and frames. Scales the noise of the motion,
/// so that the uncertainty of the velocity after a second does not depend on the number of steps.
alidade::Config ConfigOf(const std::string& file, int points, int frames, int seed) {
  alidade::Config config = alidade::Config::FromFile(file);
  const auto set = [&](const char* key, double value) {
    config.Set(key, std::to_string(value), "bench");
  };
  config.Set("source.seed", std::to_string(seed), "bench");
  config.Set("source.points.count", std::to_string(points), "bench");
  config.Set("source.max_frames", std::to_string(frames), "bench");
  const double fraction = (frames - 1.0) / (kAllFrames - 1.0);  // steps / all steps
  set("source.rate_hz", kAllRateHz * fraction);
  for (const char* key : {"linear_acceleration", "angular_acceleration"}) {
    const std::string path = std::string("state.cam.noise.") + key;
    const double reference_noise = config.root().At("state").At("cam").At("noise").At(key).Number();
    set(path.c_str(), reference_noise * std::sqrt(fraction));
  }
  return config;
}

/// Runs an estimator on frames that were simulated in advance. Only the time of the estimator is
/// measured.
Outcome RunOne(alidade::EstimatorSpec& spec, const std::vector<alidade::SourceFrame>& frames,
               std::size_t truth) {
  Outcome outcome;
  alidade::Estimator& estimator = *spec.estimator;
  const double start = alidade::bench::CpuNs();
  for (const alidade::SourceFrame& frame : frames) estimator.Process(frame);
  const auto record = [&](const alidade::State& state) {
    outcome.cpu_ns = alidade::bench::CpuNs() - start;
    outcome.log2_det = Log2Det(state);
    const double* const position = state.value(state.layout().Find("cam.position"));
    const std::vector<double>& true_position = frames.back().truth[truth];
    outcome.error_m = std::hypot(position[0] - true_position[0], position[1] - true_position[1],
                                 position[2] - true_position[2]);
  };
  if (estimator.offline()) {
    estimator.Smooth([&](std::size_t k, const alidade::State& state, const auto&) {
      if (k + 1 == frames.size()) record(state);
    });
  } else {
    record(estimator.state());
  }
  outcome.is_valid =
      !estimator.failed() && !estimator.diverged() && std::isfinite(outcome.log2_det);
  return outcome;
}

/// Runs all estimators. Returns the outcome of each estimator by its name.
std::map<std::string, Outcome> RunAll(const alidade::Config& config,
                                      const alidade::PluginHost& host) {
  alidade::Experiment experiment = alidade::BuildExperiment(config, host);
  std::vector<alidade::SourceFrame> frames;
  for (alidade::SourceFrame frame; experiment.source->Next(frame);) frames.push_back(frame);
  const auto& truths = experiment.source->truths();
  const auto position_truth = std::ranges::find(truths, "cam.position", &alidade::StreamInfo::name);
  std::map<std::string, Outcome> outcomes;
  for (alidade::EstimatorSpec& spec : experiment.estimators) {
    outcomes[spec.name] =
        RunOne(spec, frames, static_cast<std::size_t>(position_truth - truths.begin()));
  }
  return outcomes;
}

/// Results of one estimator with given numbers of points and frames.
struct Row {
  std::string estimator;
  int points = 0, frames = 0;
  std::vector<Outcome> runs;

  double Rmse() const {
    double sum = 0.0;
    for (const Outcome& run : runs) sum += run.error_m * run.error_m;
    return std::sqrt(sum / static_cast<double>(runs.size()));
  }
  double MeanLog2Det() const {
    double sum = 0.0;
    for (const Outcome& run : runs) sum += run.log2_det;
    return sum / static_cast<double>(runs.size());
  }
  double MedianCpu() const {
    std::vector<double> ns;
    for (const Outcome& run : runs) ns.push_back(run.cpu_ns);
    std::ranges::sort(ns);
    return ns[ns.size() / 2];
  }
};

std::vector<Row> Measure(const std::string& config, int seeds) {
  const alidade::PluginHost host(alidade::PluginPaths(alidade::Config::FromFile(config)));
  std::vector<Row> rows;
  for (const std::string& estimator : kEstimators) {
    for (const int points : kPoints) {
      for (const int frames : kFrames) rows.push_back({estimator, points, frames, {}});
    }
  }
  for (int seed = 1001; seed < 1001 + seeds; ++seed) {
    std::fprintf(stderr, "seed %d\n", seed);
    for (Row& row : rows) {
      if (row.estimator != kEstimators[0]) continue;
      const auto outcomes = RunAll(ConfigOf(config, row.points, row.frames, seed), host);
      for (Row& candidate : rows) {
        if (candidate.points != row.points || candidate.frames != row.frames) continue;
        const auto found = outcomes.find(candidate.estimator);
        if (found == outcomes.end()) {
          throw alidade::Error(alidade::ExitCode::kBadConfig,
                               config + ": the config needs the estimators 'ekf' and 'batch'");
        }
        if (found->second.is_valid) candidate.runs.push_back(found->second);
      }
    }
  }
  return rows;
}

/// Writes the csv file, and prints the same table on standard output.
void Write(const std::vector<Row>& rows, const std::filesystem::path& file) {
  std::ofstream csv(file);
  csv << "estimator,points,frames,runs,rmse_m,bits,cpu\n";
  std::printf(
      "| estimator | points | frames | runs | rmse mm | bits | cpu "
      "|\n|---|---|---|---|---|---|---|\n");
  const Row& smallest = rows.front();
  if (smallest.runs.empty()) {
    throw alidade::Error(alidade::ExitCode::kDiverged,
                         "no run of '" + smallest.estimator + "' with " +
                             std::to_string(smallest.points) + " points and " +
                             std::to_string(smallest.frames) + " frames succeeded");
  }
  for (const Row& row : rows) {
    if (row.runs.empty()) continue;
    const double bits = 0.5 * (smallest.MeanLog2Det() - row.MeanLog2Det());
    const double cpu = row.MedianCpu() / smallest.MedianCpu();
    csv << row.estimator << ',' << row.points << ',' << row.frames << ',' << row.runs.size() << ','
        << row.Rmse() << ',' << bits << ',' << cpu << '\n';
    std::printf("| %s | %d | %d | %zu | %.1f | %.1f | %.3g |\n", row.estimator.c_str(), row.points,
                row.frames, row.runs.size(), 1e3 * row.Rmse(), bits, cpu);
  }
  if (!csv.flush()) {
    throw alidade::Error(alidade::ExitCode::kIo, file.string() + ": the file cannot be written");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: %s CONFIG FOLDER [SEEDS]\n", argv[0]);
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[2];
    std::filesystem::create_directories(folder);
    const std::vector<Row> rows = Measure(argv[1], argc == 4 ? std::max(1, std::atoi(argv[3])) : 5);
    Write(rows, folder / "why_filter.csv");
  } catch (const alidade::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return static_cast<int>(error.code());
  }
  return 0;
}
