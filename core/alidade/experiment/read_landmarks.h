// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/problem.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade::internal {

/// Reads the additional keys of the landmark sensor `name` from its config entry: the role
/// `landmark`, and `outlier_rejection`. Also creates the model of the sensor for the representation
/// xyz. Errors: kBadConfig.
void ReadLandmarkKeys(const std::string& name, const Node& entry, const SensorModel& model,
                      const PluginHost& host, SensorOptions& options);

/// Reads the map `landmarks` of the root. Returns nullopt if no sensor measures landmarks. Errors:
/// kBadConfig, for example if the sensors do not support an option of the map.
std::optional<LandmarkOptions> ReadLandmarks(const Node& root,
                                             const std::vector<SensorBinding>& sensors);

}  // namespace alidade::internal
