// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/output_folder.h"
#include "alidade/sweep/sweep.h"

/// Reprojection error over the frames of a varied sweep.
namespace alidade::internal {

/// Observer that records the RMS of the innovations z - h of each landmark sensor in each frame, as
/// in `NAME/reprojection.csv`. h is evaluated at the prediction. Only the first 500 frames of a run
/// are recorded.
class ReprojectionRecorder : public RunObserver {
 public:
  void Begin(const Experiment& experiment) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  /// Returns the recorded errors and releases them.
  std::vector<FrameErrors> Release() { return std::move(errors_); }

 private:
  struct SensorIndex {
    int estimator, sensor;
  };

  std::vector<FrameErrors> errors_;
  std::vector<SensorIndex> sensors_;  ///< sensor of each entry of errors_
};

/// Writes `reprojection.csv`. Each value, estimator, landmark sensor and frame has a row with the
/// mean over the used runs (SweepRun::UsesMetricsOf). If there are no errors, the file is not
/// written. Errors: kCannotCreate, kIo.
void WriteReprojection(const OutputFolder& folder, const VariedSweep& sweep);

}  // namespace alidade::internal
