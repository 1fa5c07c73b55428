// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/model/plugin_abi.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade::internal {

/// Returns a host for creating one model. The caller sets the functions of the host, which receive
/// `context`.
AlidadeHost MakeHost(void* context);

/// Reader of a model's parameters. It searches the following maps for a parameter, in this order:
///
///   1. the config entry of the model; a dotted key addresses nested maps
///   2. the root of the config, for keys that begin with `camera.` or `landmarks.`, which
///      the sensors and the source share
///   3. the calibration of the data, which is the map `calibration` at the root
///      (WithCalibration); it provides a key without a dot only if the parameter has no default
///
/// If both the config and the calibration contain a value, the two values must agree within a
/// relative tolerance of 1e-6. The reader collects all errors, so that one run reports all of them.
/// A request that breaks the rules of plugin_abi.h is an error kPlugin.
class ParamReader {
 public:
  /// `owner` is the name of the model in messages, such as `model 'scale_2d'`. If `representation`
  /// is one of the choices of `landmarks.representation`, it replaces the value of this key.
  /// `has_covariance` is true if the entry contains a covariance instead of the model's noise. The
  /// model's parameters `sigma_*` and `noise.*` then have placeholder values, and the entry must
  /// not contain these keys. `bound_geometries` are the geometries of the blocks that are bound to
  /// roles of a sensor, for the parameter `roles` (BoundRoles in alidade/model/bound_roles.h).
  ParamReader(const Node& entry, std::string owner, std::string representation = {},
              bool has_covariance = false,
              std::map<std::string, std::string> bound_geometries = {});
  ParamReader(const ParamReader&) = delete;
  ParamReader& operator=(const ParamReader&) = delete;

  const AlidadeHost& host() const { return host_; }
  /// Returns the reason why the model cannot be created if the plugin reported a reason that does
  /// not concern a single key; otherwise "".
  const std::string& failure() const { return failure_; }
  /// Throws one Error that contains all collected errors. They are sorted by position, because the
  /// order of the reads depends on the compiler. If a call failed for another reason, such as a
  /// lack of memory, throws the exception of that call instead.
  void Check() const;

 private:
  /// Required key that the config does not contain. Its message is composed after all keys were
  /// requested, so that it does not suggest to rename one of them.
  struct MissingKey : std::exception {
    MissingKey(const Node& parent, std::string name, std::string text)
        : map(parent), key(std::move(name)), meaning(std::move(text)) {}
    Node map;             ///< map that should contain the key
    std::string key;      ///< the key in `map`, which may contain dots
    std::string meaning;  ///< unit, range and description of the parameter
  };

  static std::int32_t Read(void* context, const AlidadeParam* param, double* values,
                           std::int32_t capacity) noexcept;
  static std::int32_t ReadText(void* context, const AlidadeParam* param, char* text,
                               std::int32_t capacity) noexcept;
  static void Fail(void* context, const char* key, const char* text) noexcept;
  AlidadeParam Expect(const std::function<AlidadeParam()>& check);
  Node BaseOf(const std::string& key) const;
  std::vector<double> Values(const AlidadeParam& param) const;
  std::string TextOf(const AlidadeParam& param) const;
  std::string RolesText() const;
  std::optional<Node> InCalibration(const std::string& key) const;
  void ExpectCalibrated(const AlidadeParam& param, const Node& node,
                        const std::vector<double>& values) const;
  std::vector<double> Absent(const AlidadeParam& param, const Node& map,
                             const std::string& key_in_map) const;
  std::string TextOfMissing(const MissingKey& missing) const;

  Node entry_;
  std::string owner_, representation_;
  bool has_covariance_;
  std::map<std::string, std::string> bound_geometries_;
  ExitCode code_ = ExitCode::kBadConfig;  ///< exit code of `errors_`
  AlidadeHost host_{};
  std::unordered_set<std::string> keys_;  ///< all requested keys
  std::vector<std::string> errors_;
  std::vector<MissingKey> missing_;
  std::string failure_;
  /// Exception that a call caught. It is stored because it must not propagate into the plugin.
  std::exception_ptr exception_;
};

/// Recorder of the parameters that a model requests while it is created with placeholder values.
class ParamRecorder {
 public:
  ParamRecorder();
  ParamRecorder(const ParamRecorder&) = delete;
  ParamRecorder& operator=(const ParamRecorder&) = delete;

  const AlidadeHost& host() const { return host_; }
  /// Runs `create` once with every choice at its default or, without a default, at its first value.
  /// Then runs `create` once for each other value of each choice.
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
  /// Returns all requested parameters. Required parameters are first, then parameters with a
  /// default, then parameters that depend on a choice.
  std::vector<ParamInfo> Result() const;

 private:
  struct Request {
    ParamInfo info;
    int value = 0;  ///< for a choice: index that Read() returned
  };
  struct Trial {
    /// Key of the choice whose value differs from the first trial; "" for the first trial.
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
