// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/defect_node.h"

#include <string>
#include <string_view>

#include "alidade/experiment/name_in_entry.h"

namespace alidade::internal {
namespace {

/// Returns the item of the list `consider` that names `block`. `state` is the state entry of the
/// block.
Node FindConsiderItem(const Node& state, const Block& block) {
  const Node list = state.At("consider");
  for (const Node& item : list.Items()) {
    if (item.Text() == NameInEntry(block)) return item;
  }
  return list;
}

}  // namespace

Node FindDefectNode(const ProblemDefect& defect, const Node& root, const Problem& problem) {
  if (defect.block >= 0) {
    const Block& block = problem.layout[defect.block];
    const auto entry = root.At("state").Find(block.owner);
    // If `state` does not contain the owner of the block, the owner is a sensor.
    const Node state = entry ? *entry : root.At("sensors").At(block.owner);
    if (defect.key == std::string_view("consider")) return FindConsiderItem(state, block);
    return state.At("initial").At(NameInEntry(block)).At(defect.key);
  }
  if (defect.sensor < 0) return root.At("landmarks");
  const SensorBinding& sensor = problem.sensors[static_cast<std::size_t>(defect.sensor)];
  const Node roles = root.At("sensors").At(sensor.name).At("roles");
  const auto role = roles.Find(sensor.model->roles()[static_cast<std::size_t>(defect.role)].name);
  if (!role) return roles;  // the role of a time offset is not in the config
  return role->At(defect.key);
}

}  // namespace alidade::internal
