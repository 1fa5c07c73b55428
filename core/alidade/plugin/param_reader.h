// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade::internal {

/// Returns the host of one creation of a model. The caller sets the host's functions, which receive
/// `context`.
AlidadeHost MakeHost(void* context);

/// Reader of a model's parameters. It searches these maps for a parameter, in this order:
///
///   1. the config entry of the model; a dotted key addresses nested maps
///   2. the root of the config, for keys that begin with `camera.` or `landmarks.`, which
///      the sensors and the source share
///   3. the calibration of the data, `calibration` at the root (WithCalibration); a key without a
///      dot is read there only if the parameter has no default
///
/// If both the config and the calibration contain a value, the two must agree to a relative 1e-6.
/// The reader collects all errors, so one run reports all of them. A request that breaks the rules
/// of plugin_abi.h is an error kPlugin.
class ParamReader {
 public:
  /// `owner` names the model in messages, such as `model 'scale_2d'`. `representation` replaces the
  /// value of `landmarks.representation`, if it is one of the choices. `has_covariance` is true if
  /// the entry contains a covariance instead of the model's noise. The model's parameters `sigma_*`
  /// and `noise.*` then have stand-in values, and the entry must not contain them.
  ParamReader(const Node& entry, std::string owner, std::string representation = {},
              bool has_covariance = false);
  ParamReader(const ParamReader&) = delete;
  ParamReader& operator=(const ParamReader&) = delete;

  const AlidadeHost& host() const { return host_; }
  /// Returns the reason why the model cannot be created, if the reason does not concern a single
  /// key; otherwise "".
  const std::string& failure() const { return failure_; }
  /// Throws one Error kBadConfig that contains all errors, sorted by position (the order of the
  /// reads depends on the compiler). If a call failed for another reason, such as a lack of memory,
  /// throws that exception instead. Returns if there was no error.
  void Check() const;

 private:
  static std::int32_t Read(void* context, const AlidadeParam* param, double* values,
                           std::int32_t capacity) noexcept;
  static std::int32_t ReadText(void* context, const AlidadeParam* param, char* text,
                               std::int32_t capacity) noexcept;
  static void Fail(void* context, const char* key, const char* text) noexcept;
  AlidadeParam Expect(const std::function<AlidadeParam()>& check);
  Node BaseOf(const std::string& key) const;
  std::vector<double> Values(const AlidadeParam& param) const;
  std::string TextOf(const AlidadeParam& param) const;
  std::optional<Node> InCalibration(const std::string& key) const;
  void ExpectCalibrated(const AlidadeParam& param, const Node& node,
                        const std::vector<double>& values) const;
  std::vector<double> Absent(const AlidadeParam& param, const Node& map,
                             const std::string& key_in_map) const;
  [[noreturn]] void FailMissing(const AlidadeParam& param, const Node& map,
                                const std::string& key_in_map) const;

  Node entry_;
  std::string owner_, representation_;
  bool has_covariance_;
  ExitCode code_ = ExitCode::kBadConfig;  ///< exit code of `errors_`
  AlidadeHost host_{};
  std::unordered_set<std::string> keys_;  ///< all requested keys
  std::vector<std::string> errors_;
  std::string failure_;
  /// Exception of a call, stored because it must not reach the plugin.
  std::exception_ptr exception_;
};

/// Recorder of the parameters that a model requests while it is created with stand-in values.
class ParamRecorder {
 public:
  ParamRecorder();
  ParamRecorder(const ParamRecorder&) = delete;
  ParamRecorder& operator=(const ParamRecorder&) = delete;

  const AlidadeHost& host() const { return host_; }
  /// Runs `create` once with the default, else the first value, of every choice. Then runs it once
  /// for each other value of each choice.
  template <class Create>
  void Run(const Create& create) {
    trials_.assign(1, Trial{});
    create();
    const std::vector<Request> first = trials_[0].requests;
    for (const Request& choice : first) {
      for (int i = 0; i < static_cast<int>(choice.info.choices.size()); ++i) {
        if (i == choice.value) continue;
        trials_.push_back({choice.info.key, i, {}});
        create();
      }
    }
  }
  /// Returns all requested parameters: the required ones, those with a default, and those that
  /// depend on a choice.
  std::vector<ParamInfo> Result() const;

 private:
  struct Request {
    ParamInfo info;
    int value = 0;  ///< index that was returned, if the parameter is a choice
  };
  struct Trial {
    /// Key of the choice that differs from the first trial; "" in the first trial.
    std::string choice;
    int value = 0;
    std::vector<Request> requests;
  };
  static std::int32_t Read(void* context, const AlidadeParam* param, double* values,
                           std::int32_t capacity) noexcept;
  static std::int32_t ReadText(void* context, const AlidadeParam* param, char* text,
                               std::int32_t capacity) noexcept;
  void Record(const AlidadeParam& param, int value);
  std::string ConditionOf(const std::string& key) const;

  AlidadeHost host_{};
  std::vector<Trial> trials_;
  bool out_of_memory_ = false;
};

}  // namespace alidade::internal
