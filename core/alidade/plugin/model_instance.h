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
/// Destroys the model of `instance`. Logs an exception of the plugin as a warning.
void DestroyInstance(const AlidadeInstance& instance, const std::string& name,
                     const std::string& plugin) noexcept;
}  // namespace internal

/// Owner of one model instance that a plugin created. Provides the description of the instance as
/// C++ values.
class ModelInstance {
 public:
  /// Takes ownership of `instance`. Messages contain the `name` of the model and the file `plugin`.
  /// Errors: kPlugin if the description breaks the rules of plugin_abi.h.
  ModelInstance(const AlidadeInstance& instance, std::string name, std::string plugin);
  ~ModelInstance();
  ModelInstance(const ModelInstance&) = delete;
  ModelInstance& operator=(const ModelInstance&) = delete;

  const AlidadeInstance& c() const { return instance_; }
  const std::string& name() const { return name_; }
  const std::string& plugin() const { return plugin_; }
  /// Returns the roles of a sensor, or the blocks of a motion model.
  const std::vector<Space>& spaces() const { return spaces_; }
  /// Returns the prior and dynamics of each role for which the model defines a prior. The key is
  /// the index of the role.
  const std::map<std::size_t, OwnedRole>& owned() const { return owned_; }
  /// Returns the space of a sensor's measurement, or of a motion model's control input. The name of
  /// the space is empty if the motion model has no control input.
  const Space& space() const { return space_; }
  /// Returns the space of the known numbers of each measurement. The name of the space is empty if
  /// measurements have no known numbers.
  const Space& known() const { return known_; }
  bool has_input() const { return description_.input_count > 0; }
  unsigned capabilities() const { return capabilities_; }
  /// Returns the order in dt of the difference between two successive steps of a motion model and
  /// one step over the total time. Returns 0 if there is no difference.
  int step_order() const {
    return static_cast<int>(capabilities_ >> ALIDADE_STEP_ORDER_SHIFT & 15u);
  }
  /// Replaces the model's noise by the covariance L L', which is R of a sensor or Qw of a motion
  /// model. `root` is L, n x n row-major.
  void SetNoise(std::vector<double> root);
  /// Returns the matrix L of SetNoise(), or an empty vector if the model's own noise applies.
  const std::vector<double>& noise_root() const { return noise_root_; }
  /// Returns the error text of the last call in this thread that returned ALIDADE_ERROR; "" if
  /// there was no such call.
  std::string error_text() const;

 private:
  void ReadCalls();
  void ReadDescription();
  void CheckSupported() const;
  void ReadRoles();
  void ReadOwned(const AlidadeOwned& owned, const Space& role, std::size_t index);
  Space ReadSpace(const AlidadeSpace& space, const std::string& subject) const;
  [[noreturn]] void Refuse(const std::string& reason) const;

  AlidadeInstance instance_;  ///< its pointers refer to the members below
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
