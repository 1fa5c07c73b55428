// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/host/source.h"

namespace alidade::internal {

/// `evaluate.truth_sigma` of the config's root: for each truth of the source the standard deviation
/// of its elements; empty where the key is not there. Errors: kBadConfig for a name that is no
/// truth's, a number below 0, and under a `reference` that is no truth.
std::vector<double> ReadTruthSigmas(const Node& root, const std::vector<StreamInfo>& truths,
                                    bool is_reference);

}  // namespace alidade::internal
