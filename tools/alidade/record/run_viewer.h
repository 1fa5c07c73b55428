// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// Viewer of a run. It shows each image with the measured features, 3 sigma of their innovations,
/// and their marks. Next to the image it shows the estimate of the first online estimator.
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

  /// Adds a video as output. Close() completes the file `.avi`. Errors: kPlugin if this build does
  /// not include OpenCV; kCannotCreate, also if the file exists and `force` is false.
  void AddVideo(const std::filesystem::path& file, bool force);
  /// Adds a window as output. Errors: kPlugin if this build does not include windows; kCannotCreate
  /// if there is no display.
  void AddWindow();
  void OnFrame(const SourceFrame& frame) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Completes the outputs. Must also be called after a run that ended early. Errors: kIo,
  /// kCannotCreate.
  void Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
