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

/// A host for one creation: its functions, which the caller sets, get `context`.
AlidadeHost MakeHost(void* context);

/// Lends a model the parameters of its config entry. A dotted key walks nested maps. What begins
/// with `camera.` or `landmarks.` and is not in the entry is read from the map of that name at the
/// root of the config, which sensors and source share. What is in neither is read from the
/// calibration of the data, `calibration` at the root (WithCalibration); there a key without a dot
/// stands only for a parameter that has no default. What is in the config and in the calibration
/// must be the same to 1e-6 of its value. Everything wrong is collected, so that one
/// run tells all; kPlugin where the model itself asks against the rules of plugin_abi.h.
class ParamReader {
 public:
  /// `owner` names the model in messages, as in `model 'scale_2d'`.
  /// `representation` is the value of `landmarks.representation` where it is one of the choices;
  /// "": what is written. `noise_given`: the entry has a covariance in place of the model's noise,
  /// whose parameters, `sigma_*` and `noise.*`, are stand-ins; one that is written is refused.
  ParamReader(const Node& entry, std::string owner, std::string representation = {},
              bool noise_given = false);
  ParamReader(const ParamReader&) = delete;
  ParamReader& operator=(const ParamReader&) = delete;

  const AlidadeHost& host() const { return host_; }
  /// Why the model says that it cannot be made, where that belongs to no key; else "".
  const std::string& failure() const { return failure_; }
  /// Throws all errors as one, kBadConfig, in the order of their places (that of the reads depends
  /// on the compiler), or what else went wrong in a call, as memory that ran out; returns where
  /// there is nothing.
  void Check() const;

 private:
  static std::int32_t Read(void* context, const AlidadeParam* param, double* values,
                           std::int32_t capacity) noexcept;
  static std::int32_t ReadText(void* context, const AlidadeParam* param, char* text,
                               std::int32_t capacity) noexcept;
  static void Fail(void* context, const char* key, const char* text) noexcept;
  AlidadeParam Expect(const std::function<AlidadeParam()>& checked);
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
  bool noise_given_;
  ExitCode code_ = ExitCode::kBadConfig;  ///< of the errors
  AlidadeHost host_{};
  std::unordered_set<std::string> keys_;  ///< that were asked for
  std::vector<std::string> errors_;
  std::string failure_;
  std::exception_ptr thrown_;  ///< by a call from the plugin, which must not see it
};

/// Notes what a model asks for while it is created with stand-in values.
class ParamRecorder {
 public:
  ParamRecorder();
  ParamRecorder(const ParamRecorder&) = delete;
  ParamRecorder& operator=(const ParamRecorder&) = delete;

  const AlidadeHost& host() const { return host_; }
  /// Runs `create` once, then again for each other value of each choice, one at a time.
  template <class Create>
  void Run(const Create& create) {
    trials_.assign(1, Trial{});
    create();
    const std::vector<Asked> first = trials_[0].asked;
    for (const Asked& choice : first) {
      for (int i = 0; i < static_cast<int>(choice.info.choices.size()); ++i) {
        if (i == choice.value) continue;
        trials_.push_back({choice.info.key, i, {}});
        create();
      }
    }
  }
  /// All keys that were asked for: the required ones, those with a default, and those that a choice
  /// asks for.
  std::vector<ParamInfo> Result() const;

 private:
  struct Asked {
    ParamInfo info;
    int value = 0;  ///< of a choice: the one given
  };
  struct Trial {
    std::string choice;  ///< "" in the first
    int value = 0;
    std::vector<Asked> asked;
  };
  static std::int32_t Read(void* context, const AlidadeParam* param, double* values,
                           std::int32_t capacity) noexcept;
  static std::int32_t ReadText(void* context, const AlidadeParam* param, char* text,
                               std::int32_t capacity) noexcept;
  void Note(const AlidadeParam& param, int value);
  std::string When(const std::string& key) const;

  AlidadeHost host_{};
  std::vector<Trial> trials_;
  bool out_of_memory_ = false;
};

}  // namespace alidade::internal
