// SPDX-License-Identifier: Apache-2.0
#include "estimator_types.h"

#include <algorithm>

#include "alidade/iekf.h"
#include "alidade/rts.h"
#include "alidade/square_root_ekf.h"
#include "alidade/ukf.h"
#include "filter_options.h"

namespace alidade::internal {
namespace {

std::vector<ParamInfo> CommonSchema() { return SchemaOf(ReadCommonOptions); }

template <class Filter>
EstimatorMaker Maker(const auto& options) {
  return [options](const System& system, const std::vector<StreamInfo>& streams) {
    return std::make_unique<Filter>(system, options, streams);
  };
}

EstimatorMaker ReadEkf(const Node& entry) { return Maker<Ekf>(EkfOptions::FromNode(entry)); }
EstimatorMaker ReadIekf(const Node& entry) { return Maker<Iekf>(IekfOptions::FromNode(entry)); }
EstimatorMaker ReadRts(const Node& entry) {
  return Maker<RtsSmoother>(OptionsFromNode(entry, "rts", ReadCommonOptions));
}
EstimatorMaker ReadSquareRoot(const Node& entry) {
  return Maker<SquareRootEkf>(OptionsFromNode(entry, "square_root_ekf", ReadCommonOptions));
}
EstimatorMaker ReadUkf(const Node& entry) { return Maker<Ukf>(UkfOptions::FromNode(entry)); }

/// Fails at `node`: the type cannot have `what`.
[[noreturn]] void Refuse(const EstimatorType& type, const Node& node, const std::string& what,
                         const std::string& instead) {
  node.Fail(std::string("estimator type '") + type.name + "' does not support " + what,
            instead + " (also by the estimator's `overrides`), or type: ekf");
}

std::string NameIn(const Block& block) { return block.name.substr(block.owner.size() + 1); }

/// The item `block` of the list under `consider` of its state entry.
Node ConsiderOf(const Node& root, const Block& block) {
  const Node list = root.At("state").At(block.owner).At("consider");
  for (const Node& item : list.Items()) {
    if (item.Text() == NameIn(block)) return item;
  }
  return list;
}

void RefuseBlocks(const EstimatorType& type, const Node& root, const System& system) {
  for (const Block& block : system.layout.blocks()) {
    if (block.status == BlockStatus::kConsidered && !type.support.considered) {
      Refuse(type, ConsiderOf(root, block), "considered blocks", "the block estimated or fixed");
    }
  }
  for (const Prior& prior : system.priors) {
    if (prior.from.empty() || type.support.recovery) continue;
    const Block& block = system.layout[prior.block];
    const Node initial = root.At("state").At(block.owner).At("initial").At(NameIn(block));
    Refuse(type, initial.At("from"), "blocks that start from a measurement", "mean and sigma");
  }
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
  constexpr Support kPlain = {};
  static const std::vector<EstimatorType> types = {
      {"ekf",
       "Extended Kalman filter; built in, for `estimators`.",
       ReadEkf,
       EkfOptions::Schema,
       {.considered = true,
        .at_measurement = true,
        .recovery = true,
        .robust_loss = true,
        .landmarks = true}},
      {"iekf",
       "Iterated extended Kalman filter; built in, for `estimators`.",
       ReadIekf,
       IekfOptions::Schema,
       {.considered = false, .at_measurement = false, .recovery = true, .robust_loss = true}},
      {"rts",
       "Fixed-interval smoother after an extended Kalman filter; built in, for `estimators`.",
       ReadRts, CommonSchema, kPlain},
      {"square_root_ekf",
       "Extended Kalman filter that carries a square root of P; built in, for `estimators`.",
       ReadSquareRoot, CommonSchema, kPlain},
      {"ukf", "Unscented Kalman filter; built in, for `estimators`.", ReadUkf, UkfOptions::Schema,
       kPlain},
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
  const auto refuse = [&](const std::string& key, const std::string& what) {
    const auto of_key = [&](const ParamInfo& info) {
      return info.key == key || info.key.starts_with(key + '.');
    };
    const auto node = entry.Find(key);
    if (!node || std::ranges::any_of(keys, of_key)) return;
    node->Fail(std::string("estimator type '") + type.name + "' has no " + what,
               "the key left out, or type: ekf");
  };
  refuse("jacobian", "choice of Jacobian");
  refuse("lockout", "recovery from a lock-out");
}

void RefuseUnsupported(const EstimatorType& type, const Node& root, const System& system) {
  RefuseBlocks(type, root, system);
  if (system.landmarks && !type.support.landmarks) {
    Refuse(type, root.At("landmarks"), "landmarks", "`sensors` that measure none");
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
