// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/system.h"

#include <algorithm>

namespace alidade {

State System::InitialState(bool reserved) const {
  State state(layout);
  std::vector<const Prior*> in_order;
  for (const Prior& prior : priors) in_order.push_back(&prior);
  std::ranges::stable_sort(in_order, {}, &Prior::block);
  for (const Prior* const one : in_order) {
    const Prior& prior = *one;
    if (!prior.from.empty() && reserved) state.Reserve(prior.block);
    if (!prior.from.empty()) continue;
    ALIDADE_EXPECTS(std::ssize(prior.mean) == layout[prior.block].geometry().ambient);
    state.Add(prior.block, prior.mean.data(), prior.covariance);
  }
  return state;
}

int System::FindSensor(std::string_view name) const {
  const auto found = std::find_if(sensors.begin(), sensors.end(),
                                  [name](const SensorBinding& s) { return s.name == name; });
  return found == sensors.end() ? -1 : static_cast<int>(found - sensors.begin());
}

BlockId internal::PositionBlockOf(const System& system) {
  BlockId path = -1;
  for (const SensorBinding& binding : system.sensors) {
    if (!binding.model->has_landmark()) continue;
    for (std::size_t r = 0; r < binding.roles.size(); ++r) {
      const BlockId id = binding.roles[r].block;
      const bool position = binding.model->roles()[r].name == "position" && id >= 0;
      if (position && system.layout[id].geometry().ambient == 3) path = id;
    }
  }
  return path;
}

std::string internal::UnitOf(const System& system, BlockId id) {
  if (!system.layout[id].space.unit.empty()) return system.layout[id].space.unit;
  for (const SensorBinding& sensor : system.sensors) {
    for (std::size_t r = 0; r < sensor.roles.size(); ++r) {
      if (sensor.roles[r].block == id) return sensor.model->roles()[r].unit;
    }
  }
  return {};
}

}  // namespace alidade
