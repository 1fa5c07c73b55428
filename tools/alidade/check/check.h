// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/plugin/plugin_host.h"

/// Whether a model of a plugin keeps the rules of plugin_abi.h, tried in a process of its own.
namespace alidade {

/// What is tried, and how far a plugin may go.
struct CheckOptions {
  std::uint64_t seed = 1;   ///< of the states
  int states = 48;          ///< random ones, besides those at the edges
  double timeout_s = 10.0;  ///< wall-clock time of one check
  int memory_mb = 1024;     ///< that the model may take
  /// A Step that is additive in dt only up to an error of this order passes (2: Euler); 0: of the
  /// order that the model declares, if it does, else exactly.
  int step_order = 0;
  /// The parameters may have keys that the model does not read, as an entry of a run's config has.
  bool other_keys = false;
};

/// What came of one check.
struct Finding {
  enum class Verdict { kOk, kFail, kSkipped };
  Verdict verdict = Verdict::kSkipped;
  std::string check;  ///< `jacobian`
  std::string words;  ///< what was seen; of a failure the call, the state and the numbers
};

/// Checks the model `entry` of `host` made from `parameters`, each check in a child process with
/// the limits of `options`. After one on which the rest depends has failed, the rest is skipped.
/// docs/check.md lists the checks. Errors: kBadConfig where the parameters do not fit.
std::vector<Finding> CheckModel(const PluginEntry& entry, const Node& parameters,
                                const CheckOptions& options = {});

/// The sensors and motion models of `plugin`: a file, a file's name on the search path without
/// `alidade_` and `.so`, or the name of a model; of these the one named `model` unless that is "".
/// Errors: kPlugin where there is none.
std::vector<PluginEntry> FindModels(const PluginHost& host, const std::string& plugin,
                                    const std::string& model = "");

/// Findings as lines `verdict  check  words`, below the name of the model.
std::string CheckText(const PluginEntry& entry, const std::vector<Finding>& findings);

/// Whether one of the findings is a failure.
bool AnyFailure(const std::vector<Finding>& findings);

}  // namespace alidade
