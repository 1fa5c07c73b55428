// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "alidade/io/output_folder.h"
#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// Writes `sweep.csv`: a row for each value; for each estimator how many runs count and diverged,
/// and mean and quantiles of every metric. Errors: kCannotCreate, kIo.
void WriteSweepCsv(const OutputFolder& folder, const VariedSweep& sweep);

/// The text of `table.md`: for each estimator a row for each value.
std::string VariedMarkdown(const VariedSweep& sweep);

/// Draws `figures/vary.svg` from sweep.csv: errors, lags, coverage and divergence over the values.
/// Returns "", or the reason why the figure was not drawn. Errors: kIo.
std::string DrawVariation(const OutputFolder& folder, const VariedSweep& sweep,
                          const std::function<bool()>& stop);

}  // namespace alidade::internal
