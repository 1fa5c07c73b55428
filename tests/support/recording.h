// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "alidade/record/recorder.h"
#include "support/systems.h"
#include "support/temporary_folder.h"

/// Small run to record, and functions that read the resulting folder. For tests.
namespace alidade::testing {

namespace fs = std::filesystem;

inline std::string Read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream.is_open()) << file;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

inline std::vector<std::string> Lines(const fs::path& file) {
  std::istringstream text(Read(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

inline std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells = {""};
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

/// Source with a target at the depth 0.3 + 0.1 sin(0.4 * 2 pi t). The measurements have a small
/// deterministic error. Only every other frame contains the disparity.
class SwingingTarget : public Source {
 public:
  explicit SwingingTarget(int frames) : frames_(frames) {}
  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  bool Next(SourceFrame& frame) override {
    if (next_ == frames_) return false;
    const double t_s = 0.033 * next_;
    const double depth = 0.3 + 0.1 * std::sin(2.5133 * t_s), wobble = std::sin(37.0 * next_);
    frame = {FrameAt(t_s, {{1, depth / 0.3 + 0.002 * wobble}}), {{depth}}};
    if (next_ % 2 == 0) {
      frame.measurements.push_back({frame.timestamp, 0, -1, {26.0 / depth + wobble}, {}});
    }
    if (next_ == 3) frame.truth = {{}};
    ++next_;
    return true;
  }

 private:
  std::vector<StreamInfo> streams_ = {{"disparity", 1}, {"inverse_scale", 1}};
  std::vector<StreamInfo> truths_ = {{"depth", 1}};
  int frames_, next_ = 0;
};

inline Experiment MakeExperiment(int frames = 60) {
  Experiment experiment;
  experiment.source = std::make_unique<SwingingTarget>(frames);
  for (const char* name : {"ekf", "alone"}) {
    EstimatorSpec named;
    named.name = name;
    named.type = "ekf";
    named.problem = DepthFilter();
    if (named.name == "alone") named.problem.sensors.pop_back();
    named.estimator =
        std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
    experiment.estimators.push_back(std::move(named));
  }
  experiment.seed = 42;
  return experiment;
}

inline const PluginHost& Host() {
  static const PluginHost host;
  return host;
}

inline Config MakeConfig() {
  return Config::FromText("alidade: 1\ntitle: A <swinging> target\n", "swing.yaml");
}

inline Recorder::Options OptionsFor(const fs::path& folder, bool force = false) {
  return {folder, force, "alidade run swing.yaml"};
}

/// Runs the experiment with `recorder` as the observer.
inline RunResult RunInto(Recorder& recorder, Experiment& experiment) {
  RunOptions options;
  options.observers = {&recorder};
  return Run(experiment, options);
}

inline void Record(const Recorder::Options& options, int frames = 60) {
  Experiment experiment = MakeExperiment(frames);
  Recorder recorder(options, MakeConfig());
  RunResult result = RunInto(recorder, experiment);
  result.estimators[0].events.push_back(
      {33'000'000, EventKind::kEstimatorSpecific, "a \"word\", and\nanother"});
  result.estimators[0].events.push_back({kNoTimestamp, EventKind::kEstimatorSpecific, "timeless"});
  recorder.Finish(result);
}

/// Returns the exit code of the error that `call` throws, or 0 if `call` throws no error. `text`
/// receives the message of the error.
template <class Call>
int CodeOf(const Call& call, std::string* text = nullptr) {
  try {
    call();
  } catch (const Error& error) {
    if (text != nullptr) *text = error.what();
    return static_cast<int>(error.code());
  }
  return 0;
}

/// Runs `call` in a child process. Returns the exit code of the child process, or 128 + n if signal
/// n ended the child process.
template <class Call>
int InChild(const Call& call) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(CodeOf(call));
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

inline std::vector<std::string> FilesIn(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace alidade::testing
