// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/run/run.h"

namespace alidade {

/// Writes a run folder (docs/run_folder.md). Everything goes to a temporary folder next to it, is
/// synced, and takes its name at the end, also where the run failed: `run.json` then says why. Once
/// there are frames, nothing of it is lost: where it cannot be finished (a full disk, a crash) the
/// temporary folder becomes `FOLDER.failed-PID`, rows as complete as they were a second before.
/// Every write is checked. Errors: kCannotCreate, kIo with the path, and what was kept.
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
    /// Continues what unfinished runs left here: see `alidade run --resume` in docs/cli.md.
    bool resume = false;
  };
  /// Creates the temporary folder. Errors: kCannotCreate where `folder` exists without `force` and
  /// is no unfinished run to be resumed, or one that was made from other inputs.
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
  /// Writes run.json, comparison.csv, timing.json, figures and report.html, syncs and renames. A
  /// figure or report that cannot be written is an error once the rest has its name. A run that
  /// resumes others has to have their rows: it fails with kFound where these differ, and with its
  /// own code where it ended before their last; they are then kept in its stead.
  void Finish(const RunResult& result);
  /// Where it will be kept, not finished; "" where there is nothing to keep, or it is finished.
  std::filesystem::path failed() const;
  /// Gives what was recorded that name at once; false where that cannot be done. Of another thread
  /// than that of the run, which must not go on.
  bool Abandon() const;
  /// The temporary folder.
  const std::filesystem::path& partial() const;
  /// The folders of the unfinished runs that this one resumes.
  const std::vector<std::filesystem::path>& resumed() const;

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
