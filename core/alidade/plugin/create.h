// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/model/params.h"
#include "alidade/plugin/model_instance.h"
#include "alidade/plugin/plugin_host.h"

/// Creation of models and other objects from the entries of a PluginHost. All functions are
/// thread-safe. A lock ensures that only one thread at a time creates an object.
namespace alidade {

/// Creates a model from its config entry `node`. Does not reject unread keys; the caller must call
/// Node::RejectUnread. If `representation` is not "", it replaces the parameter
/// `landmarks.representation` of a sensor that offers this choice. `bound_geometries` are the
/// geometries of the blocks that are bound to the roles of a sensor. Errors: kPlugin, kBadConfig.
std::shared_ptr<const ModelInstance> CreateModel(
    const PluginEntry& entry, const Node& node, const std::string& representation = {},
    const std::map<std::string, std::string>& bound_geometries = {});
/// Returns the parameters that a model reads. To find the parameters, this function creates the
/// model with placeholder values, once for each value of each choice.
std::vector<ParamInfo> ModelSchema(const PluginEntry& entry);
/// Returns one line for each role or block of a model, one for its measurement or control input,
/// and one for each capability. Creates the model with placeholder values. Returns an empty list
/// for a factory.
std::vector<std::string> DescribeModel(const PluginEntry& entry);

/// Runs `call` with the parameters in `node`. `call` calls the factory of `entry` and returns true
/// if the factory created an object. Throws the errors of the parameters, otherwise the Error of
/// the factory. Any other exception of the factory becomes an Error kPlugin.
void CallFactory(const PluginEntry& entry, const Node& node,
                 const std::function<bool(Params&)>& call);
/// Returns the keys that the entry of a factory lists, followed by the parameters that `call`
/// reads. `call` receives placeholder values.
std::vector<ParamInfo> FactorySchema(const PluginEntry& entry,
                                     const std::function<void(Params&)>& call);

}  // namespace alidade
