// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/experiment/experiment.h"

namespace alidade::internal {

/// Reads `report.rows`: the keys of the main rows of a run, in their order (MetricKey). Returns an
/// empty list if `report` is missing. Error: kBadConfig for a key that no run has.
std::vector<std::string> ReadReportRows(const Node& root, const Problem& problem,
                                        const std::vector<Segment>& segments);

}  // namespace alidade::internal
