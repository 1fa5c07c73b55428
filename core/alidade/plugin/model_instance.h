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
/// Destroys the model of `instance`. An exception is logged as a warning.
void DestroyInstance(const AlidadeInstance& instance, const std::string& name,
                     const std::string& plugin) noexcept;
}  // namespace internal

/// Owner of one instance that a plugin created. It provides the description as C++ values.
class ModelInstance {
 public:
  /// Takes ownership of `instance`. Messages contain the model's `name` and its file `plugin`.
  /// Errors: kPlugin if the description breaks the rules of plugin_abi.h.
  ModelInstance(const AlidadeInstance& instance, std::string name, std::string plugin);
  ~ModelInstance();
  ModelInstance(const ModelInstance&) = delete;
  ModelInstance& operator=(const ModelInstance&) = delete;

  const AlidadeInstance& c() const { return instance_; }
  const std::string& name() const { return name_; }
  const std::string& plugin() const { return plugin_; }
  const std::vector<Space>& spaces() const { return spaces_; }  ///< roles, or blocks
  /// Returns prior and dynamics by role, for the roles whose prior the model defines.
  const std::map<std::size_t, OwnedRole>& owned() const { return owned_; }
  /// Returns the measurement of a sensor, or the control input of a motion model. The name is empty
  /// for a motion model without control input.
  const Space& space() const { return space_; }
  /// Returns the known numbers that come with each measurement. The name is empty without them.
  const Space& known() const { return known_; }
  bool has_input() const { return description_.input_count > 0; }
  unsigned capabilities() const { return capabilities_; }
  /// Returns the order in dt of the error with which the step of a motion model is additive in dt;
  /// 0 if it is exactly additive.
  int step_order() const {
    return static_cast<int>(capabilities_ >> ALIDADE_STEP_ORDER_SHIFT & 15u);
  }
  /// Replaces the model's noise by L, n x n row-major: R = L L' of a sensor, or Qw = L L' of a
  /// motion model.
  void SetNoise(std::vector<double> root);
  /// Returns the L of SetNoise; empty if the model's noise applies.
  const std::vector<double>& noise_root() const { return noise_root_; }
  /// Returns the text of the last call in this thread that returned ALIDADE_ERROR; "" without one.
  std::string error_text() const;

 private:
  void ReadCalls();
  void ReadDescription();
  void CheckSupported() const;
  void ReadRoles();
  void ReadOwned(const AlidadeOwned& owned, const Space& role, std::size_t index);
  Space ReadSpace(const AlidadeSpace& space, const std::string& subject) const;
  [[noreturn]] void Refuse(const std::string& reason) const;

  AlidadeInstance instance_;  ///< its pointers refer to the copies below
  AlidadeDescription description_{};
  AlidadeSensor sensor_{};
  AlidadeMotion motion_{};
  std::string name_, plugin_;
  std::vector<Space> spaces_;
  std::map<std::size_t, OwnedRole> owned_;
  Space space_, known_;
  std::vector<double> noise_root_;
  unsigned capabilities_ = 0;
};

}  // namespace alidade
