// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"

#include "alidade/plugin/create.h"

namespace alidade {

std::unique_ptr<Source> CreateSource(const PluginHost& host, const Config& config,
                                     std::uint64_t seed, bool any_order) {
  const Node node = config.root().At("source", "a run, because it provides the measurements");
  const PluginEntry& entry = host.Find(kSourceKind, node.At("type", "a source").Text(), node);
  const auto& factory = *static_cast<const SourceEntry*>(entry.factory);
  std::unique_ptr<Source> source;
  CallFactory(entry, node, [&](Params& params) {
    source = factory.create(
        SourceArguments{node, params, seed, config.folder(), any_order, &config, &host});
    return source != nullptr;
  });
  return source;
}

std::vector<ParamInfo> SourceSchema(const PluginEntry& entry) {
  ALIDADE_EXPECTS(entry.kind == kSourceKind);
  const auto& factory = *static_cast<const SourceEntry*>(entry.factory);
  const Config stand_in = Config::FromText("type: " + entry.name, "stand-in");
  return FactorySchema(entry, [&](Params& params) {
    static_cast<void>(factory.create(SourceArguments{stand_in.root(), params, 1, {}}));
  });
}

}  // namespace alidade
