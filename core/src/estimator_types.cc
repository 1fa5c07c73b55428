// SPDX-License-Identifier: Apache-2.0
#include "estimator_types.h"

#include <algorithm>

#include "alidade/iekf.h"

namespace alidade::internal {
namespace {

template <class Filter>
EstimatorMaker Maker(const auto& options) {
  return [options](const System& system, const std::vector<StreamInfo>& streams) {
    return std::make_unique<Filter>(system, options, streams);
  };
}

EstimatorMaker ReadEkf(const Node& entry) { return Maker<Ekf>(EkfOptions::FromNode(entry)); }
EstimatorMaker ReadIekf(const Node& entry) { return Maker<Iekf>(IekfOptions::FromNode(entry)); }

/// Fails at `node`: the type `name` cannot have `what`.
[[noreturn]] void Refuse(const EstimatorType& type, const Node& node, const std::string& what,
                         const std::string& instead) {
  node.Fail(std::string("estimator type '") + type.name + "' does not support " + what,
            instead + " (also by the estimator's `overrides`), or type: ekf");
}

/// The item `block` of the list under `consider` of its state entry.
Node ConsiderOf(const Node& root, const Block& block) {
  const Node list = root.At("state").At(block.owner).At("consider");
  for (const Node& item : list.Items()) {
    if (block.owner + '.' + item.Text() == block.name) return item;
  }
  return list;
}

void RefuseRole(const EstimatorType& type, const RoleBinding& role, const Node& node) {
  if (role.mode == RoleMode::kConsider && !type.support.considered) {
    Refuse(type, node.At("mode"), "considered roles", "estimate or hold");
  }
  if (role.linearise_at == LineariseAt::kMeasurement && !type.support.at_measurement) {
    Refuse(type, node.At("linearise_at"), "linearise_at: measurement", "prediction");
  }
}

}  // namespace

const std::vector<EstimatorType>& EstimatorTypes() {
  static const std::vector<EstimatorType> types = {
      {"ekf",
       "Extended Kalman filter; built in, for `estimators`.",
       ReadEkf,
       EkfOptions::Schema,
       {.considered = true, .at_measurement = true, .robust_loss = true}},
      {"iekf",
       "Iterated extended Kalman filter; built in, for `estimators`.",
       ReadIekf,
       IekfOptions::Schema,
       {.considered = false, .at_measurement = false, .robust_loss = true}},
  };
  return types;
}

const EstimatorType* FindEstimatorType(std::string_view name) {
  const auto& types = EstimatorTypes();
  const auto found = std::ranges::find_if(types, [&](const auto& t) { return t.name == name; });
  return found == types.end() ? nullptr : &*found;
}

void RefuseUnsupportedKeys(const EstimatorType& type, const Node& entry) {
  const std::vector<ParamInfo> keys = type.schema();
  const auto jacobian = entry.Find("jacobian");
  if (!jacobian || std::ranges::find(keys, "jacobian", &ParamInfo::key) != keys.end()) return;
  jacobian->Fail(std::string("estimator type '") + type.name + "' has no choice of Jacobian",
                 "the key left out, or type: ekf");
}

void RefuseUnsupported(const EstimatorType& type, const Node& root, const System& system) {
  for (const Block& block : system.layout.blocks()) {
    if (block.status == BlockStatus::kConsidered && !type.support.considered) {
      Refuse(type, ConsiderOf(root, block), "considered blocks", "the block estimated or fixed");
    }
  }
  for (const SensorBinding& sensor : system.sensors) {
    const Node entry = root.At("sensors").At(sensor.name);
    for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
      const auto node = entry.At("roles").Find(sensor.model.roles()[i].name);
      if (node) RefuseRole(type, sensor.roles[i], *node);
    }
    if (sensor.loss.kind != LossKind::kNone && !type.support.robust_loss) {
      Refuse(type, entry.At("loss"), "robust losses", "the sensor without one");
    }
  }
}

}  // namespace alidade::internal
