// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/record/contents.h"
#include "alidade/record/figure_script.h"

namespace alidade::internal {

/// The error x (-) x_true of each element with truth over time, within +-3 sigma; angles and
/// rotations in degrees. Empty where no truth is known.
std::vector<FigureScript> ErrorFigures(const RecordedRun& run, const RecordedEstimator& estimator);

}  // namespace alidade::internal
