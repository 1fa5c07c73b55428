// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade {

/// Writes a run folder (docs/run_folder.md). It grows as `FOLDER.partial`, with `run.json` saying
/// `running` from the beginning, and takes its name at the end, also if the run failed: `run.json`
/// then says why. If it cannot be finished (a full disk, a killed process), `FOLDER.partial` stays
/// with the rows so far, once there are frames. Every write is checked. Errors: kCannotCreate, kIo
/// with the path.
class Recorder : public RunObserver {
 public:
  struct Options {
    std::filesystem::path folder;
    bool force = false;               ///< replace what is there
    bool figures = true;              ///< draw with gnuplot where it is installed
    std::string command;              ///< of the program, for timing.json
    std::function<bool()> stop = {};  ///< true: leave out the figures that are not drawn yet
    double drawing_s = 60.0;          ///< the most that all figures may take
    bool covariances = false;         ///< write `NAME/covariance.bin` too
    std::string inputs = {};          ///< the text of inputs.json; "": there is none
    /// What run.json says of plugins: file name -> SHA-256, for each file.
    std::multimap<std::string, std::string> plugins = {};
  };
  /// Creates `FOLDER.partial`. Error: kCannotCreate if it or `folder` exists, without `force`.
  Recorder(const Options& options, const Config& config);
  ~Recorder() override;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Writes the headers, once the experiment is known.
  void Begin(const Experiment& experiment) override;
  void OnFrame(const SourceFrame& frame) override;
  void OnTime(int estimator, double wall_s) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Puts a file of that text into the folder too. Errors: kCannotCreate, kIo.
  void AddFile(const std::string& name, std::string_view text);
  /// Writes comparison.csv, timing.json, figures, report.html and run.json, and renames the folder.
  /// If a figure or the report cannot be written, the folder is complete without them, and that is
  /// an error.
  void Finish(const RunResult& result);

  /// Paths that Finish made, relative to the folder, those a person wants first: report.html, ...
  const std::vector<std::string>& highlights() const;
  /// What was left out and why ("gnuplot is not installed: no figures"), or "".
  const std::string& note() const;
  const std::filesystem::path& folder() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
