// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade {
namespace internal {
struct Conclusion;
}

/// Writer of a run folder (docs/run_folder.md). During the run the folder is `FOLDER.partial`, and
/// `run.json` has the status `running`. After the run the folder is renamed. If the run failed,
/// `run.json` contains the reason. If the folder cannot be completed (full disk, killed process),
/// `FOLDER.partial` remains and contains the rows written so far. An error before the first frame
/// removes it. Every write is checked. Errors: kCannotCreate, kIo with the path.
class Recorder : public RunObserver {
 public:
  struct Options {
    std::filesystem::path folder;
    bool force = false;        ///< true: replaces an existing folder
    std::string command = {};  ///< command line of the program, for timing.json
    bool covariances = false;  ///< true: also writes `NAME/covariance.bin`
    std::string inputs = {};   ///< text of inputs.json; "": the file is not written
    /// Plugins that run.json lists: file name -> SHA-256.
    std::multimap<std::string, std::string> plugins = {};
    /// Longest time between a frame and its rows in the files, if further frames follow.
    std::chrono::milliseconds max_delay{1000};
  };
  /// Creates `FOLDER.partial`. Error: kCannotCreate if `FOLDER.partial` or `FOLDER` exists and
  /// `force` is false.
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
  /// Completes the folder: closes the files with data of frames, writes all other files, then
  /// run.json and report.html, and renames the folder. If report.html cannot be written, completes
  /// the folder without it, and then throws the error.
  void Finish(const RunResult& result);

  /// Returns the conclusions that Finish() has written to run.json.
  const std::vector<internal::Conclusion>& conclusions() const;
  const std::filesystem::path& folder() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
