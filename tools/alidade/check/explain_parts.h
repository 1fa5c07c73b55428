// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Returns rows that describe how landmarks are initialised, converted and pruned. Requires
/// problem.landmarks.
std::vector<TextRow> LandmarkRows(const Problem& problem);

/// Returns a row with key and value for each option of an estimator.
std::vector<TextRow> OptionRows(const Node& entry, const EstimatorSpec& spec);

}  // namespace alidade::internal
