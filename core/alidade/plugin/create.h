// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/model/params.h"
#include "alidade/plugin/model_instance.h"
#include "alidade/plugin/plugin_host.h"

/// Creation of models and other objects by the entries of a PluginHost. Thread-safe: only one
/// thread at a time calls plugin code.
namespace alidade {

/// Creates a model from its config entry `node`, whose unread keys are left to Node::RejectUnread.
/// `representation` replaces the parameter `landmarks.representation` of a sensor that has this
/// choice, unless it is "". Errors: kPlugin, kBadConfig.
std::shared_ptr<const ModelInstance> CreateModel(const PluginEntry& entry, const Node& node,
                                                 const std::string& representation = {});
/// Returns the parameters of a model, found by creating it with stand-in values, each choice in
/// turn.
std::vector<ParamInfo> ModelSchema(const PluginEntry& entry);
/// Returns a line for each role, measurement or block of a model with stand-in parameters, and for
/// each of its capabilities. Returns an empty list for a factory.
std::vector<std::string> DescribeModel(const PluginEntry& entry);

/// Runs `call`, which calls the factory of `entry` with the parameters in `node` and returns true
/// if the factory created an object. Errors: those of the parameters before those of the factory;
/// kPlugin for any other exception.
void CallFactory(const PluginEntry& entry, const Node& node,
                 const std::function<bool(Params&)>& call);
/// Returns the keys of a factory, and the parameters that `call` reads with stand-in values.
std::vector<ParamInfo> FactorySchema(const PluginEntry& entry,
                                     const std::function<void(Params&)>& call);

}  // namespace alidade
