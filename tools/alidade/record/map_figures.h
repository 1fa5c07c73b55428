// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/record/contents.h"
#include "alidade/record/figure_script.h"

namespace alidade::internal {

/// Trajectory and landmarks at the end, and truth, over the two axes along which they reach
/// farthest: from above, as a rule. What lies far off is left out. Empty where there are none.
FigureScript MapFigure(const RecordedRun& run, const RecordedEstimator& estimator);

/// The rms of the accepted innovations of each frame, by sensor. Empty where there are none.
FigureScript ReprojectionFigure(const RecordedRun& run, const RecordedEstimator& estimator);

}  // namespace alidade::internal
