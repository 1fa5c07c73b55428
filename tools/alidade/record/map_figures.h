// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/record/figure_script.h"
#include "alidade/record/recorded_run.h"

namespace alidade::internal {

/// Trajectory, landmarks within +-3 sigma and truth, from three sides: x-y, x-z and y-z, each in
/// one scale. Landmarks that were removed are paler. What lies far off is left out. Empty where
/// there are none.
FigureScript MapFigure(const RecordedRun& run, const RecordedEstimator& estimator);

/// The rms of the accepted innovations of each frame, by sensor. Empty where there are none.
FigureScript ReprojectionFigure(const RecordedRun& run, const RecordedEstimator& estimator);

}  // namespace alidade::internal
