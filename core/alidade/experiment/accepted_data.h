// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Returns `frame` with only the measurements that an estimator accepted or used to initialise a
/// state. `problem` and `report` are those of the estimator. At most one sensor may read each
/// stream.
Frame AcceptedMeasurements(const Frame& frame, const std::vector<StreamInfo>& streams,
                           const Problem& problem, const UpdateReport& report);

}  // namespace alidade::internal
