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

/// Estimators as C++ plugins.
namespace alidade {

inline constexpr const char* kEstimatorKind = "estimator";

/// Creates an estimator with options that were read before; `streams` are those of the source.
using EstimatorMaker = std::function<std::unique_ptr<Estimator>(
    const Problem& problem, const std::vector<StreamInfo>& streams)>;

/// Arguments of the factory of an estimator.
struct EstimatorArguments {
  Node entry;      ///< the config's entry of `estimators`
  Params& params;  ///< the same entry, read by declaration (numbers, flags, choices)
};

/// Factory of an estimator.
struct EstimatorEntry {
  const char* name;
  const char* doc;
  const char* citation;
  /// Reads the options and returns a function that creates the estimator for a problem. Errors of
  /// both: an Error with a place, as thrown by Node::Fail.
  EstimatorMaker (*create)(const EstimatorArguments& arguments);
  EstimatorKind kind = EstimatorKind::kFilter;
  /// Capabilities of the estimator. A problem that needs more is rejected with an error that names
  /// the missing capability, before the estimator is created. Null: it does not support landmarks,
  /// and must itself reject everything else that it does not support.
  const EstimatorCapabilities* capabilities = nullptr;
};
constexpr CppEntry EntryOf(const EstimatorEntry& estimator) {
  return {kEstimatorKind, estimator.name, estimator.doc, estimator.citation, "", &estimator};
}

/// Returns the factory of `entry`, which must be an estimator.
const EstimatorEntry& EstimatorOf(const PluginEntry& entry);

/// Returns the maker of the estimator `name` with the options in `node`. Errors: kPlugin with the
/// places searched, kBadConfig, those of the estimator.
EstimatorMaker CreateEstimator(const PluginHost& host, const std::string& name, const Node& node);

/// Returns the parameters of the estimator `entry`.
std::vector<ParamInfo> EstimatorSchema(const PluginEntry& entry);

}  // namespace alidade

/// Exports the estimators of this plugin:
/// ALIDADE_ESTIMATOR_PLUGIN({"name", "doc", "citation", &Create}, ...)
#define ALIDADE_ESTIMATOR_PLUGIN(...) ALIDADE_CPP_PLUGIN(alidade::EstimatorEntry, __VA_ARGS__)
