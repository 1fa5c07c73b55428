// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/run/run.h"

namespace alidade::internal {

/// `frame` with those of its measurements alone that an estimator of `system` accepted or took as
/// first values, as its `report` of the frame says. Each of its streams goes to one sensor.
Frame AcceptedOf(const Frame& frame, const std::vector<StreamInfo>& streams, const System& system,
                 const UpdateReport& report);

/// Index of the estimator whose accepted measurements `named` is to see, as the key `use` says; -1:
/// it sees all. `before` are those listed before it. Error: kBadConfig.
int ReadUse(const Node& use, const NamedEstimator& named, const Node& estimators,
            const std::vector<NamedEstimator>& before);

}  // namespace alidade::internal
