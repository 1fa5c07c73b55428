// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/estimation/models.h"
#include "alidade/model/plugin_abi.h"

namespace alidade {

namespace internal {
/// Destroys the model of `instance`. An exception is a warning.
void DestroyInstance(const AlidadeInstance& instance, const std::string& name,
                     const std::string& plugin) noexcept;
}  // namespace internal

/// Owns one instance that a plugin created, and its description as C++ values.
class ModelInstance {
 public:
  /// Takes `instance` over. `name` is the model's, `plugin` the file it came from, for messages.
  /// Errors: kPlugin where the description breaks the rules of plugin_abi.h.
  ModelInstance(const AlidadeInstance& instance, std::string name, std::string plugin);
  ~ModelInstance();
  ModelInstance(const ModelInstance&) = delete;
  ModelInstance& operator=(const ModelInstance&) = delete;

  const AlidadeInstance& c() const { return instance_; }
  const std::string& name() const { return name_; }
  const std::string& plugin() const { return plugin_; }
  const std::vector<Space>& spaces() const { return spaces_; }  ///< roles, or blocks
  /// By role, if the model says.
  const std::map<std::size_t, OwnedRole>& owned() const { return owned_; }
  /// The measurement of a sensor, the control input of a motion model (empty name: none).
  const Space& space() const { return space_; }
  /// What comes with each measurement and is no state (empty name: nothing).
  const Space& known() const { return known_; }
  bool has_input() const { return description_.input_count > 0; }
  unsigned capabilities() const { return capabilities_; }
  /// Of a motion model whose step is additive in dt but for an error: its order in dt; else 0.
  int step_order() const {
    return static_cast<int>(capabilities_ >> ALIDADE_STEP_ORDER_SHIFT & 15u);
  }
  /// Takes L, n x n row-major, in place of the model's noise: of a sensor R = L L', of a motion
  /// model Qw = L L'.
  void GiveNoise(std::vector<double> root);
  /// What GiveNoise took; empty: the noise is the model's.
  const std::vector<double>& given_noise() const { return given_noise_; }
  /// Of its last call in this thread that returned ALIDADE_ERROR; empty: it does not say.
  std::string error_text() const;

 private:
  void ReadCalls();
  void ReadDescription();
  void CheckSupported() const;
  void ReadRoles();
  void ReadOwned(const AlidadeOwned& owned, const Space& role, std::size_t index);
  Space ReadSpace(const AlidadeSpace& space, const std::string& what) const;
  [[noreturn]] void Refuse(const std::string& why) const;

  AlidadeInstance instance_;  ///< its pointers lead to the copies below
  AlidadeDescription description_{};
  AlidadeSensor sensor_{};
  AlidadeMotion motion_{};
  std::string name_, plugin_;
  std::vector<Space> spaces_;
  std::map<std::size_t, OwnedRole> owned_;
  Space space_, known_;
  std::vector<double> given_noise_;
  unsigned capabilities_ = 0;
};

}  // namespace alidade
