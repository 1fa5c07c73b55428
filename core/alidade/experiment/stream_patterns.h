// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/frame.h"

namespace alidade {

/// Replaces each sensor whose `stream` contains `*`, as in `range_*`, by one sensor for each stream
/// that matches. The text for which `*` stands also replaces the `*` in the name of the sensor:
/// `beacon_*` becomes `beacon_7` for the stream `range_7`. Names of sensors in the keys `sensors`
/// and `overrides.sensors` of estimators are expanded in the same way. `config` must not share its
/// tree with another config. Errors: kBadConfig if no stream matches, or if the name of the sensor
/// does not contain `*`.
void ExpandStreamPatterns(Config& config, const std::vector<StreamInfo>& streams);

}  // namespace alidade
