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

/// Makes an estimator, its options read, once its problem is known; `streams` are the source's.
using EstimatorMaker = std::function<std::unique_ptr<Estimator>(
    const Problem& problem, const std::vector<StreamInfo>& streams)>;

/// What an estimator reads its options from.
struct EstimatorArguments {
  Node entry;      ///< the config's entry of `estimators`
  Params& params;  ///< the same entry, read by declaration (numbers, flags, choices)
};

/// The factory of an estimator.
struct EstimatorEntry {
  const char* name;
  const char* doc;
  const char* citation;
  /// Reads the options; what it returns makes the estimator once its problem is known. Errors of
  /// both: an Error with a place, as of Node::Fail.
  EstimatorMaker (*create)(const EstimatorArguments& arguments);
  EstimatorKind kind = EstimatorKind::kFilter;
  /// What it can do; what a problem asks for beyond is refused by name before `create`'s maker is
  /// asked. Null: it takes no landmarks, and refuses by itself what else it cannot do.
  const EstimatorCapabilities* capabilities = nullptr;
};
constexpr CppEntry EntryOf(const EstimatorEntry& estimator) {
  return {kEstimatorKind, estimator.name, estimator.doc, estimator.citation, "", &estimator};
}

/// The factory of `entry`, which is of an estimator.
const EstimatorEntry& EstimatorOf(const PluginEntry& entry);

/// The maker of the estimator `name`, whose options are in `node`. Errors: kPlugin with the places
/// searched, kBadConfig, those of the estimator.
EstimatorMaker CreateEstimator(const PluginHost& host, const std::string& name, const Node& node);

/// The parameters of the estimator `entry`.
std::vector<ParamInfo> EstimatorSchema(const PluginEntry& entry);

}  // namespace alidade

/// Exports the estimators of this plugin:
/// ALIDADE_ESTIMATOR_PLUGIN({"name", "doc", "citation", &Create}, ...)
#define ALIDADE_ESTIMATOR_PLUGIN(...) ALIDADE_CPP_PLUGIN(alidade::EstimatorEntry, __VA_ARGS__)
