// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Shows a run: each image with the features that were measured in it, 3 sigma of their
/// innovations, and what became of them; next to it the estimate of the first estimator that gives
/// one with each frame.
///
/// Errors of the constructor: kBadConfig where the source has no images, frames do not come as the
/// source gives them, or each estimator waits for the last frame. Later ones: those of ImageWriter.
class RunViewer : public RunObserver {
 public:
  /// The experiment, and `title` above its estimate.
  RunViewer(const Experiment& experiment, const std::string& title);
  ~RunViewer() override;
  RunViewer(const RunViewer&) = delete;
  RunViewer& operator=(const RunViewer&) = delete;

  /// Shows it in a video too, a file `.avi` that appears in Close(). Errors: kPlugin where this
  /// build has no OpenCV; kCannotCreate, also where the file is there without `force`.
  void AddVideo(const std::filesystem::path& file, bool force);
  /// Shows it in a window too. Errors: kPlugin where this build has no window; kCannotCreate where
  /// there is no display.
  void AddWindow();
  void OnFrame(const SourceFrame& frame) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Completes what was written, also of a run that ended early. Errors: kIo, kCannotCreate.
  void Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
