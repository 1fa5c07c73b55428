// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Viewer of a run. It shows each image with the measured features, their marks, and the 3-sigma
/// ellipses of their predicted positions. Next to the image it shows the estimate of the first
/// online estimator.
///
/// Errors of the constructor: kBadConfig if the source has no images, if frames are reordered, or
/// if no estimator is online. Errors of other functions: those of ImageWriter.
class RunViewer : public RunObserver {
 public:
  /// Shows `title` above the estimate.
  RunViewer(const Experiment& experiment, const std::string& title);
  ~RunViewer() override;
  RunViewer(const RunViewer&) = delete;
  RunViewer& operator=(const RunViewer&) = delete;

  /// Adds a video as output. `file` ends in `.avi`; Close() completes it. Errors: kPlugin if this
  /// build does not include OpenCV; kCannotCreate if the file cannot be created, or exists and
  /// `force` is false.
  void AddVideo(const std::filesystem::path& file, bool force);
  /// Adds a window as output. Errors: kPlugin if this build cannot open windows; kCannotCreate if
  /// there is no display.
  void AddWindow();
  void OnFrame(const SourceFrame& frame) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Completes the outputs. It must also be called after an interrupted run. Errors: kIo,
  /// kCannotCreate.
  void Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
