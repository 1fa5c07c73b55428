// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/model/params.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/plugin_host.h"

/// Estimators that C++ plugins provide.
namespace alidade {

inline constexpr const char* kEstimatorKind = "estimator";

/// Function that creates an estimator. The function already contains the options of the estimator.
/// `streams` are the streams of the source.
using EstimatorMaker = std::function<std::unique_ptr<Estimator>(
    const Problem& problem, const std::vector<StreamInfo>& streams)>;

/// Arguments of the factory of an estimator.
struct EstimatorArguments {
  Node entry;  ///< the config's entry of `estimators`
  /// Reader of `entry`. The reader also declares each parameter (numbers, flags, choices).
  Params& params;
};

/// Factory of an estimator.
struct EstimatorEntry {
  const char* name;
  const char* doc;
  const char* citation;
  /// Reads the options and returns a function that creates the estimator for a problem. Both this
  /// function and the returned function report an error by throwing an Error that contains a place
  /// (see Node::Fail).
  EstimatorMaker (*create)(const EstimatorArguments& arguments);
  EstimatorKind kind = EstimatorKind::kFilter;
  /// Capabilities of the estimator. If a problem needs a capability that is missing, an error names
  /// this capability, and the estimator is not created. If `capabilities` is null, the estimator
  /// does not support landmarks, and must itself reject all other problems that it does not
  /// support.
  const EstimatorCapabilities* capabilities = nullptr;
};
constexpr CppEntry EntryOf(const EstimatorEntry& estimator) {
  return {kEstimatorKind, estimator.name, estimator.doc, estimator.citation, "", &estimator};
}

/// Returns the factory of `entry`, which must be an estimator.
const EstimatorEntry& EstimatorOf(const PluginEntry& entry);

/// Reads the options of the estimator `name` from `node`, and returns a function that creates the
/// estimator. Errors: kPlugin with the searched places, kBadConfig, and those of the estimator.
EstimatorMaker CreateEstimator(const PluginHost& host, const std::string& name, const Node& node);

/// Returns the parameters of the estimator `entry`.
std::vector<ParamInfo> EstimatorSchema(const PluginEntry& entry);

}  // namespace alidade

/// Exports the estimators of this plugin:
/// ALIDADE_ESTIMATOR_PLUGIN({"name", "doc", "citation", &Create}, ...)
#define ALIDADE_ESTIMATOR_PLUGIN(...) ALIDADE_CPP_PLUGIN(alidade::EstimatorEntry, __VA_ARGS__)
