// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/problem.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade::internal {

/// What the entry `name` of a sensor of landmarks has besides: its landmark roles together, as the
/// role `landmark`; `outlier_rejection`; and the model made for the representation xyz. Errors:
/// kBadConfig.
void ReadLandmarkKeys(const std::string& name, const Node& entry, const SensorModel& model,
                      const PluginHost& host, SensorOptions& options);

/// The map `landmarks` of the config's root, as the sensors need it; none where no sensor measures
/// landmarks. Errors: kBadConfig where it does not fit them.
std::optional<LandmarkOptions> ReadLandmarks(const Node& root,
                                             const std::vector<SensorBinding>& sensors);

}  // namespace alidade::internal
