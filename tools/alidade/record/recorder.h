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

/// Writer of a run folder (docs/run_folder.md). Until the end the folder is `FOLDER.partial`, and
/// `run.json` has the status `running`. At the end it is renamed, also if the run failed;
/// `run.json` then has the reason. If it cannot be finished (a full disk, a killed process),
/// `FOLDER.partial` remains with the rows so far, if there was a frame. Every write is checked.
/// Errors: kCannotCreate, kIo with the path.
class Recorder : public RunObserver {
 public:
  struct Options {
    std::filesystem::path folder;
    bool force = false;               ///< replace an existing folder
    bool figures = true;              ///< draw figures with gnuplot if it is installed
    std::string command;              ///< command line of the program, for timing.json
    std::function<bool()> stop = {};  ///< returns true to skip the remaining figures
    double drawing_s = 60.0;          ///< time limit of all figures
    bool covariances = false;         ///< also write `NAME/covariance.bin`
    std::string inputs = {};          ///< the text of inputs.json; "": no such file
    /// Plugins for run.json: file name -> SHA-256.
    std::multimap<std::string, std::string> plugins = {};
  };
  /// Creates `FOLDER.partial`. Error: kCannotCreate if it or `folder` exists, without `force`.
  Recorder(const Options& options, const Config& config);
  ~Recorder() override;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Writes the headers of the files.
  void Begin(const Experiment& experiment) override;
  void OnFrame(const SourceFrame& frame) override;
  void OnTime(int estimator, double wall_s) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Adds a file to the folder. Errors: kCannotCreate, kIo.
  void AddFile(const std::string& name, std::string_view text);
  /// Completes the folder: closes the files of the frames, writes all other files, run.json last,
  /// and renames the folder.
  /// If a figure or the report cannot be written, it completes the folder without them and throws
  /// the error.
  void Finish(const RunResult& result);

  /// Returns the most important paths that Finish wrote, relative to the folder: report.html, ...
  const std::vector<std::string>& highlights() const;
  /// Returns a note on omitted outputs ("gnuplot is not installed: no figures"), or "".
  const std::string& note() const;
  const std::filesystem::path& folder() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
