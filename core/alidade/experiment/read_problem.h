// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/problem.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// Reads `state`, `sensors`, `landmarks`, `camera` and `initial_time_s` of the root of a config.
/// `sensor_names` selects the sensors, in this order, and the state entries that these sensors use.
/// Without sensors, all state entries are read, and are only predicted. If `sensor_names` is
/// missing, reads all sensors and state entries. Errors: kBadConfig with the place and a remedy,
/// and kPlugin.
Problem ReadProblem(const Node& root, const PluginHost& host,
                    const std::optional<std::vector<std::string>>& sensor_names);

/// Creates the motion model `model` of a state entry: that of a plugin, or of the equations in the
/// entry. Errors: kBadConfig and kPlugin.
SharedMotion CreateStateModel(const std::string& model, const Node& entry, const PluginHost& host);

/// Returns the block that each role of the map `roles` is bound to, with the name of the role.
/// Omits roles whose block does not exist, and those of landmarks.
std::vector<Space> BoundRoles(const Node& roles, const StateLayout& blocks);

/// Creates the sensor model `model` of a sensor entry: that of the equations in the entry, or of a
/// plugin, whose variant the geometries of the roles select. `bound_roles` are the blocks that the
/// key `roles` binds, with the names of the roles. Errors: kBadConfig and kPlugin.
SharedSensor CreateBoundSensor(const std::string& model, const Node& entry,
                               std::vector<Space> bound_roles, const PluginHost& host);

/// Reads a value of the space: a number or a list of numbers. A unit quaternion is a list
/// [w, x, y, z], a map {w: , x: , y: , z: }, or {rpy_deg: [ROLL, PITCH, YAW]}. Error: kBadConfig,
/// also for a unit vector or unit quaternion whose length differs from 1 by more than
/// kUnitTolerance.
std::vector<double> ReadBlockValue(const Node& node, const Space& space);

}  // namespace alidade
