// SPDX-License-Identifier: Apache-2.0
#include "supported.h"

#include <string>

namespace alidade::ceres_batch {
namespace {

/// Where a config asks for what is not supported: `sensors.stereo.roles.depth.mode`.
std::string KeyOf(const Unsupported& asked, const System& system) {
  if (asked.block >= 0) {
    const Block& block = system.layout[asked.block];
    const std::string entry = system.FindSensor(block.owner) >= 0 ? "sensors." : "state.";
    return entry + block.owner + ".consider names '" + block.name + "'";
  }
  if (asked.sensor < 0) return "landmarks";
  const SensorBinding& sensor = system.sensors[static_cast<std::size_t>(asked.sensor)];
  const auto role = static_cast<std::size_t>(asked.role);
  return "sensors." + sensor.name + ".roles." + sensor.model.roles()[role].name +
         (asked.what.starts_with("jacobian_at") ? ".jacobian_at" : ".mode");
}

}  // namespace

void CheckSupported(const System& system, const Node& entry, const char* type,
                    const Support& support) {
  const auto asked = FindUnsupported(system, support);
  if (!asked) return;
  entry.Fail("estimator type '" + std::string(type) + "' does not support " + asked->what + ": " +
                 KeyOf(*asked, system),
             asked->remedy + " (also by the estimator's `overrides`), or type: ekf");
}

}  // namespace alidade::ceres_batch
