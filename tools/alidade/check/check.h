// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/plugin/plugin_host.h"

/// Checks that a plugin's models obey the rules of plugin_abi.h, in separate processes.
namespace alidade {

/// Tested states and resource limits.
struct CheckOptions {
  std::uint64_t seed = 1;   ///< seed of the random states
  int states = 48;          ///< number of random states; edge states are added
  double timeout_s = 10.0;  ///< wall-clock time of one check
  int memory_mb = 1024;     ///< memory that the model may allocate
  /// Order up to which Step must be additive in dt (2: Euler). 0: the order that the model
  /// declares, or exactly if it declares none.
  int step_order = 0;
  /// Accepts parameters that the model does not read, as in an entry of a run's config.
  bool allows_unread_keys = false;
};

/// Result of one check.
struct Finding {
  enum class Verdict { kOk, kFail, kSkipped };
  Verdict verdict = Verdict::kSkipped;
  std::string check;  ///< `jacobian`
  std::string text;   ///< result of the check; for a failure the call, the state and the numbers
};

/// Checks the model that `entry` creates from `parameters`. Each check runs in a child process with
/// the limits of `options`. If a check fails that others depend on, the remaining checks are
/// skipped. docs/check.md lists the checks. Errors: kBadConfig if the parameters are wrong.
std::vector<Finding> CheckModel(const PluginEntry& entry, const Node& parameters,
                                const CheckOptions& options = {});

/// Finds the sensors and motion models of `plugin`: a file, the name of a file on the search path
/// without `alidade_` and `.so`, or the name of a model. `model` selects one of them by name; "":
/// all. Errors: kPlugin if there is no such model.
std::vector<PluginEntry> FindModels(const PluginHost& host, const std::string& plugin,
                                    const std::string& model = "");

/// Formats the findings as lines `verdict  check  text`, below the name of the model.
std::string CheckText(const PluginEntry& entry, const std::vector<Finding>& findings);

/// Returns true if one of the findings is a failure.
bool AnyFailure(const std::vector<Finding>& findings);

}  // namespace alidade
