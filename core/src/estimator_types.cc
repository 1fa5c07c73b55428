// SPDX-License-Identifier: Apache-2.0
#include "estimator_types.h"

#include <algorithm>

#include "alidade/rts.h"
#include "alidade/square_root_ekf.h"
#include "alidade/ukf.h"
#include "filter_options.h"

namespace alidade::internal {
namespace {

constexpr const char* kPlainSupport =
    "    blocks estimated or fixed; roles estimate, hold.\n"
    "    Not: considered blocks and roles, linearise_at measurement, blocks that start from a\n"
    "    measurement, recovery from a lock-out, control inputs, landmarks, measurements out of\n"
    "    order.\n";

std::vector<ParamInfo> CommonSchema() { return SchemaOf(ReadCommonOptions); }

template <class Filter>
EstimatorMaker Maker(const auto& options) {
  return [options](const System& system, const std::vector<StreamInfo>& streams) {
    return std::make_unique<Filter>(system, options, streams);
  };
}

EstimatorMaker ReadEkf(const Node& entry) { return Maker<Ekf>(EkfOptions::FromNode(entry)); }
EstimatorMaker ReadRts(const Node& entry) {
  return Maker<RtsSmoother>(OptionsFromNode(entry, "rts", ReadCommonOptions));
}

EstimatorMaker ReadSquareRoot(const Node& entry) {
  return Maker<SquareRootEkf>(OptionsFromNode(entry, "square_root_ekf", ReadCommonOptions));
}

EstimatorMaker ReadUkf(const Node& entry) { return Maker<Ukf>(UkfOptions::FromNode(entry)); }

std::string Who(const EstimatorType& type) {
  return std::string("estimator type '") + type.name + "'";
}

/// The item `block` of the list under `key` of a state entry.
Node ItemOf(const Node& entry, const char* key, const std::string& block) {
  for (const Node& item : entry.At(key).Items()) {
    if (item.Text() == block) return item;
  }
  return entry.At(key);
}

void RefuseBlocks(const std::string& who, const Node& root, const System& system) {
  for (const Block& block : system.layout.blocks()) {
    if (block.status != BlockStatus::kConsidered) continue;
    const Node entry = root.At("state").At(block.owner);
    ItemOf(entry, "consider", block.name.substr(block.owner.size() + 1))
        .Fail(who + " has no considered blocks",
              "the block estimated or fixed (also by the estimator's `overrides`), or type: ekf");
  }
  for (const Prior& prior : system.priors) {
    if (prior.from.empty()) continue;
    const Block& block = system.layout[prior.block];
    const std::string name = block.name.substr(block.owner.size() + 1);
    root.At("state")
        .At(block.owner)
        .At("initial")
        .At(name)
        .At("from")
        .Fail(who + " starts no block from a measurement",
              "mean and sigma (also by the estimator's `overrides`), or type: ekf");
  }
}

void RefuseRoles(const std::string& who, const Node& root, const System& system) {
  for (const SensorBinding& sensor : system.sensors) {
    for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
      const RoleBinding& role = sensor.roles[i];
      const auto at = [&](const char* key) {
        return root.At("sensors")
            .At(sensor.name)
            .At("roles")
            .At(sensor.model.roles()[i].name)
            .At(key);
      };
      if (role.mode == RoleMode::kConsider) {
        at("mode").Fail(who + " has no considered roles",
                        "estimate or hold (also by the estimator's `overrides`), or type: ekf");
      }
      if (role.linearise_at == LineariseAt::kMeasurement) {
        at("linearise_at")
            .Fail(who + " does not linearise at the measurement",
                  "prediction (also by the estimator's `overrides`), or type: ekf");
      }
    }
  }
}

}  // namespace

const std::vector<EstimatorType>& EstimatorTypes() {
  static const std::vector<EstimatorType> types = {
      {"ekf", "Extended Kalman filter; built in, for `estimators`.",
       "    blocks estimated, considered (Schmidt) or fixed; roles estimate, consider, hold;\n"
       "    linearise_at prediction or measurement; blocks that start from a measurement.\n"
       "    Not: control inputs, landmarks, measurements out of order.\n",
       ReadEkf, EkfOptions::Schema, true},
      {"rts",
       "Fixed-interval smoother after an extended Kalman filter; built in, for `estimators`.",
       kPlainSupport, ReadRts, CommonSchema, false},
      {"square_root_ekf",
       "Extended Kalman filter that carries a square root of P; built in, for `estimators`.",
       kPlainSupport, ReadSquareRoot, CommonSchema, false},
      {"ukf", "Unscented Kalman filter; built in, for `estimators`.", kPlainSupport, ReadUkf,
       UkfOptions::Schema, false},
  };
  return types;
}

const EstimatorType* FindEstimatorType(std::string_view name) {
  const auto& types = EstimatorTypes();
  const auto found = std::ranges::find_if(types, [&](const auto& t) { return t.name == name; });
  return found == types.end() ? nullptr : &*found;
}

void RefuseUnsupportedKeys(const EstimatorType& type, const Node& entry) {
  if (type.extended) return;
  if (const auto lockout = entry.Find("lockout")) {
    lockout->Fail(Who(type) + " has no recovery from a lock-out", "the key left out, or type: ekf");
  }
  if (const auto loss = entry.Find("loss")) {
    loss->Fail(Who(type) + " has no robust loss", "a gate in its place");
  }
}

void RefuseUnsupported(const EstimatorType& type, const Node& root, const System& system) {
  if (type.extended) return;
  RefuseBlocks(Who(type), root, system);
  RefuseRoles(Who(type), root, system);
}

}  // namespace alidade::internal
