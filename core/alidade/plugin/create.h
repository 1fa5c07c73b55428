// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/model/params.h"
#include "alidade/plugin/model_instance.h"
#include "alidade/plugin/plugin_host.h"

/// Creation of what plugins offer, by the entries of a PluginHost. Safe from several threads: the
/// code of plugins is called by one at a time.
namespace alidade {

/// A model from its config entry `node`: reads its parameters there, leaving unread keys to
/// Node::RejectUnread. `representation` stands for the parameter `landmarks.representation` of a
/// sensor that has this choice; "": as it is written. Errors: kPlugin, kBadConfig.
std::shared_ptr<const ModelInstance> CreateModel(const PluginEntry& entry, const Node& node,
                                                 const std::string& representation = {});
/// The parameters of a model, found by creating it with stand-in values, each choice in turn.
std::vector<ParamInfo> ModelSchema(const PluginEntry& entry);
/// Roles, measurement or blocks of a model with stand-in parameters, and its capabilities, a line
/// each; of a factory none.
std::vector<std::string> DescribeModel(const PluginEntry& entry);

/// Runs `call`, which calls the factory of `entry` with the parameters in `node` and returns
/// whether it made something. Errors: those of the parameters before those of the factory, kPlugin
/// for anything else that it throws.
void CallFactory(const PluginEntry& entry, const Node& node,
                 const std::function<bool(Params&)>& call);
/// The keys of a factory, and the parameters that `call` reads with stand-in values.
std::vector<ParamInfo> FactorySchema(const PluginEntry& entry,
                                     const std::function<void(Params&)>& call);

}  // namespace alidade
