// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/plugin/plugin_host.h"

/// Checks that the models of a plugin obey the rules of plugin_abi.h. Each check runs in a separate
/// process.
namespace alidade {

/// Number of tested states, and resource limits.
struct CheckOptions {
  std::uint64_t seed = 1;   ///< seed of the random states
  int states = 48;          ///< number of random states, in addition to the edge states
  double timeout_s = 10.0;  ///< limit of the wall-clock time of one check
  int memory_mb = 1024;     ///< memory that the model may allocate
  /// Step must be additive in dt up to an error of this order (2: Euler). 0: the order that the
  /// model declares; if the model does not declare an order, Step must be exactly additive.
  int step_order = 0;
  /// True: accepts parameters that the model does not read, such as the keys of a sensor entry that
  /// concern the estimator.
  bool allows_unread_keys = false;
};

/// Result of one check.
struct Finding {
  enum class Verdict { kOk, kFail, kSkipped };
  Verdict verdict = Verdict::kSkipped;
  std::string check;  ///< name of the check, as in `jacobian`
  std::string text;   ///< result; a failure reports the call, the state and the numbers
};

/// Checks the model that `entry` creates from `parameters`. Each check runs in a child process with
/// the limits of `options`. If a check fails on which later checks depend, these are
/// skipped. docs/check.md lists the checks. Errors: kBadConfig if the parameters are wrong.
std::vector<Finding> CheckModel(const PluginEntry& entry, const Node& parameters,
                                const CheckOptions& options = {});

/// Finds sensors and motion models. `plugin` is a file, the name of a file on the search path
/// without `alidade_` and `.so`, or the name of a model. If `model` is not empty, only the model of
/// that name is returned. Error: kPlugin if no model matches.
std::vector<PluginEntry> FindModels(const PluginHost& host, const std::string& plugin,
                                    const std::string& model = "");

/// Formats the findings as lines `verdict  check  text`, below the name of the model.
std::string CheckText(const PluginEntry& entry, const std::vector<Finding>& findings);

/// Returns true if one of the findings is a failure.
bool AnyFailure(const std::vector<Finding>& findings);

}  // namespace alidade
