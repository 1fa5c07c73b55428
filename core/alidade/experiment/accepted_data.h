// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Returns `frame` with only the measurements that an estimator of `problem` accepted, or with
/// which it initialised a state, according to its `report`. Each stream must belong to one sensor
/// only.
Frame AcceptedMeasurements(const Frame& frame, const std::vector<StreamInfo>& streams,
                           const Problem& problem, const UpdateReport& report);

}  // namespace alidade::internal
