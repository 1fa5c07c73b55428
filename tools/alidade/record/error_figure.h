// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/record/figure_script.h"
#include "alidade/record/recorded_run.h"

namespace alidade::internal {

/// The error x (-) x_true of each element with truth over time, within +-3 sigma; angles and
/// rotations in degrees. Empty where no truth is known.
std::vector<FigureScript> ErrorFigures(const RecordedRun& run, const RecordedEstimator& estimator);

/// The errors of the first estimators in one panel for each element; empty where no truth is known.
std::vector<FigureScript> ErrorComparisonFigures(const RecordedRun& run, const std::string& title);

}  // namespace alidade::internal
