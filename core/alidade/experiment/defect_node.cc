// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/defect_node.h"

#include <string>

namespace alidade::internal {
namespace {

std::string NameIn(const Block& block) { return block.name.substr(block.owner.size() + 1); }

/// The item `block` of the list under `consider` of its state entry.
Node ConsiderOf(const Node& state, const Block& block) {
  const Node list = state.At("consider");
  for (const Node& item : list.Items()) {
    if (item.Text() == NameIn(block)) return item;
  }
  return list;
}

}  // namespace

Node NodeOf(const ProblemDefect& defect, const Node& root, const Problem& problem) {
  if (defect.block >= 0) {
    const Block& block = problem.layout[defect.block];
    const auto entry = root.At("state").Find(block.owner);
    const Node state = entry ? *entry : root.At("sensors").At(block.owner);  // which owns it
    if (block.status == BlockStatus::kConsider) return ConsiderOf(state, block);
    return state.At("initial").At(NameIn(block)).At("from_measurement");
  }
  if (defect.sensor < 0) return root.At("landmarks");
  const SensorBinding& sensor = problem.sensors[static_cast<std::size_t>(defect.sensor)];
  const Node roles = root.At("sensors").At(sensor.name).At("roles");
  const auto role = roles.Find(sensor.model->roles()[static_cast<std::size_t>(defect.role)].name);
  if (!role) return roles;  // one that a time offset adds
  // A mode that cannot be done comes before jacobian_at.
  return role->At(defect.what.starts_with("jacobian_at") ? "jacobian_at" : "mode");
}

}  // namespace alidade::internal
