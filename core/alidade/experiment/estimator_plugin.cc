// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/estimator_plugin.h"

#include "alidade/base/error.h"
#include "alidade/plugin/create.h"

namespace alidade {

const EstimatorEntry& EstimatorOf(const PluginEntry& entry) {
  ALIDADE_EXPECTS(entry.kind == kEstimatorKind);
  return *static_cast<const EstimatorEntry*>(entry.factory);
}

EstimatorMaker CreateEstimator(const PluginHost& host, const std::string& name, const Node& node) {
  const PluginEntry& entry = host.Find(kEstimatorKind, name, node);
  EstimatorMaker maker;
  CallFactory(entry, node, [&](Params& params) {
    maker = EstimatorOf(entry).create(EstimatorArguments{node, params});
    return maker != nullptr;
  });
  return maker;
}

std::vector<ParamInfo> EstimatorSchema(const PluginEntry& entry) {
  const EstimatorEntry& factory = EstimatorOf(entry);
  const Config stand_in = Config::FromText("type: " + entry.name, "stand-in");
  return FactorySchema(entry, [&](Params& params) {
    static_cast<void>(factory.create(EstimatorArguments{stand_in.root(), params}));
  });
}

}  // namespace alidade
