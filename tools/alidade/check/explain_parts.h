// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// How the landmarks of a problem that has some are initialised, converted and pruned: what, and
/// how.
std::vector<TextRow> LandmarkRows(const Problem& problem);

/// What the entry of an estimator sets, a key and its value in words each.
std::vector<TextRow> OptionRows(const Node& entry, const EstimatorSpec& spec);

}  // namespace alidade::internal
