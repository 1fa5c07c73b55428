// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/model/params.h"
#include "alidade/plugin/model_instance.h"
#include "alidade/plugin/plugin_host.h"

/// Creation of models and other objects from the entries of a PluginHost. All functions are
/// thread-safe: only one thread at a time creates objects.
namespace alidade {

/// Creates a model from its config entry `node`. Does not reject unread keys; the caller does so by
/// Node::RejectUnread. Unless `representation` is "", it replaces the parameter
/// `landmarks.representation` of a sensor that offers this choice. Errors: kPlugin, kBadConfig.
std::shared_ptr<const ModelInstance> CreateModel(const PluginEntry& entry, const Node& node,
                                                 const std::string& representation = {});
/// Returns the parameters that a model reads. To find them, creates the model with stand-in values,
/// once for each value of each choice.
std::vector<ParamInfo> ModelSchema(const PluginEntry& entry);
/// Returns a line for each role or block of a model, for its measurement or input, and for each
/// capability. Creates the model with stand-in parameters. Returns an empty list for a factory.
std::vector<std::string> DescribeModel(const PluginEntry& entry);

/// Runs `call`, which calls the factory of `entry` with the parameters in `node` and returns true
/// if the factory created an object. Errors: those of the parameters, which precede those of the
/// factory; kPlugin for any other exception.
void CallFactory(const PluginEntry& entry, const Node& node,
                 const std::function<bool(Params&)>& call);
/// Returns the listed keys of a factory, followed by the parameters that `call` reads. The
/// parameters have stand-in values.
std::vector<ParamInfo> FactorySchema(const PluginEntry& entry,
                                     const std::function<void(Params&)>& call);

}  // namespace alidade
