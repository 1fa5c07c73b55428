// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// `frame` with those of its measurements alone that an estimator of `problem` accepted or took as
/// first values, as its `report` of the frame says. Each of its streams goes to one sensor.
Frame AcceptedOf(const Frame& frame, const std::vector<StreamInfo>& streams, const Problem& problem,
                 const UpdateReport& report);

}  // namespace alidade::internal
