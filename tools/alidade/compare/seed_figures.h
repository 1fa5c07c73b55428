// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "alidade/compare/compare.h"
#include "alidade/io/output_folder.h"
#include "alidade/record/figures.h"

namespace alidade::internal {

/// Writes what a comparison over several seeds shows of its estimators, and draws it:
///
///   over_time.csv   rms and quantiles of the errors, average NEES and its bounds, by timestamp
///   cost.csv        CPU time and mean errors, a row for each estimator
///   figures/        `rms.BLOCK` and `anees` over time; `cost` of the last estimates and maps,
///                   `cost.online` and `cost.smoothed` of the estimates along the run
///
/// What gnuplot cannot do is noted, no error; `stop` ends the drawing. Errors: kCannotCreate, kIo.
Figures WriteSeedFigures(const OutputFolder& folder, const Comparison& comparison,
                         const std::function<bool()>& stop);

}  // namespace alidade::internal
