// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/output_folder.h"
#include "alidade/sweep/sweep.h"

/// The reprojection error over the frames of a varied sweep.
namespace alidade::internal {

/// Follows a run: the rms of the innovations z - h of each frame and sensor of landmarks, h at the
/// prediction, as `NAME/reprojection.csv` has it; of the first 500 frames.
class ReprojectionOfRun : public RunObserver {
 public:
  void Begin(const Experiment& experiment) override;
  void OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                  const UpdateReport& report) override;
  std::vector<FrameErrors> Take() { return std::move(errors_); }

 private:
  struct Place {
    int estimator, sensor;
  };

  std::vector<FrameErrors> errors_;
  std::vector<Place> places_;  ///< of errors_
};

/// Writes `reprojection.csv`: for each value, estimator and sensor of landmarks a row for each
/// frame with the mean over the runs that count. Nothing where there are none. Errors:
/// kCannotCreate, kIo.
void WriteReprojection(const OutputFolder& folder, const VariedSweep& sweep);

/// Draws `figures/reprojection.svg` from it, a curve for each value. Returns why there is none, or
/// "", also where there is nothing to draw. Errors: kIo.
std::string DrawReprojection(const OutputFolder& folder, const VariedSweep& sweep,
                             const std::function<bool()>& stop);

}  // namespace alidade::internal
