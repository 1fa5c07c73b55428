// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Describes how landmarks are initialised, converted and pruned. Requires problem.landmarks.
std::vector<TextRow> LandmarkRows(const Problem& problem);

/// Describes the options of an estimator's entry: a row of key and value for each.
std::vector<TextRow> OptionRows(const Node& entry, const EstimatorSpec& spec);

}  // namespace alidade::internal
