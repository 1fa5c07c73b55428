// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "alidade/plugin/plugin_host.h"

/// Checks that the models of a plugin obey the rules of plugin_abi.h. Each check runs in a separate
/// process.
namespace alidade {

class ModelInstance;  // defined in alidade/plugin/model_instance.h

/// Number of tested states, and resource limits.
struct CheckOptions {
  std::uint64_t seed = 1;   ///< seed of the random states
  int states = 48;          ///< number of random states, in addition to the edge states
  double timeout_s = 10.0;  ///< maximum wall-clock time of one check
  int memory_mb = 1024;     ///< maximum memory that the model may allocate
  /// Order in dt of the error up to which Step must be additive, for example 2 for Euler's method.
  /// If the option is 0, the order that the model declares is used. If the model does not declare
  /// an order, Step must be exactly additive.
  int step_order = 0;
  /// True: parameters that the model does not read are accepted. An example is a key of a sensor
  /// entry that concerns the estimator.
  bool allows_unread_keys = false;
};

/// Result of one check.
struct CheckResult {
  enum class Verdict { kOk, kFail, kSkipped, kWarning };
  Verdict verdict = Verdict::kSkipped;
  std::string check;  ///< name of the check, as in `jacobian`
  std::string text;   ///< description of the result; a failure includes the call and the state
};

/// Creates instances of a checked model.
struct ModelCreator {
  std::function<std::shared_ptr<const ModelInstance>()> create;  ///< error: kBadConfig
  /// Throws kBadConfig if the instance did not read one of its parameters.
  std::function<void()> reject_unread = [] {};
};

/// Checks the model that `creator` creates. Each check runs in a child process with the limits of
/// `options`. The later checks are skipped if a check that they need fails, or if a child process
/// ends without an answer. docs/check.md lists the checks.
std::vector<CheckResult> CheckModel(const ModelCreator& creator, const CheckOptions& options = {});

/// Checks the model that `entry` creates from `parameters`. Error: kBadConfig if the parameters are
/// invalid.
std::vector<CheckResult> CheckModel(const PluginEntry& entry, const Node& parameters,
                                    const CheckOptions& options = {});

/// Checks of one model whose equations are in a config.
struct ConfigModelCheck {
  PluginEntry entry;
  std::string path;  ///< key path of the config entry, such as `sensors.range`
  std::vector<CheckResult> findings;
};

/// Checks all models `formula`, or all models `linear`, of the config of a run. `host` provides the
/// other models. Error: kBadConfig if the config is invalid, or contains no such model.
std::vector<ConfigModelCheck> CheckConfigModels(const Config& config, const PluginHost& host,
                                                const std::string& model,
                                                const CheckOptions& options = {});

/// Finds sensors and motion models. `plugin` is the path of a plugin file, the name of a file on
/// the search path, or the name of a model. The name of a file excludes `.so` and may exclude
/// `alidade_`. If `model` is not empty, only the model of that name is returned. Error: kPlugin if
/// no model matches.
std::vector<PluginEntry> FindModels(const PluginHost& host, const std::string& plugin,
                                    const std::string& model = "");

/// Formats the findings as lines `verdict  check  text`, below a line with the name of the model.
std::string CheckText(const PluginEntry& entry, const std::vector<CheckResult>& findings);

/// Returns true if one of the findings is a failure.
bool AnyFailure(const std::vector<CheckResult>& findings);

}  // namespace alidade
