// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/formula/formula_keys.h"

namespace alidade::internal {

/// Keys of a motion model in the config.
struct MotionKeys {
  /// `forms` are examples of `step` and `rate`.
  MotionKeys(const Node& model_entry, const char* forms);

  Node entry;
  FormulaKeys keys;
  std::vector<Space> blocks;
  std::vector<Space> inputs;
  Space input;  ///< vector of all inputs
  bool is_rate = false;
  Node equation;  ///< value of `rate` or `step`
};

/// Keys of a sensor in the config.
struct SensorKeys {
  SensorKeys(const Node& sensor_entry, const std::vector<Space>& bound_roles);

  /// Returns the map `z`, which has at least one part.
  Node Measured(const char* example) const;
  /// Returns the space of z: the only part, or the product of all parts.
  Space Measurement() const;
  /// Reads the key `covariance`. Returns L of R = L L', row-major, or nullopt if the noise is
  /// defined by `sigma`.
  std::optional<std::vector<double>> ReadSqrtCovariance() const;
  /// Compiles the key `sigma`: the standard deviations of each part.
  std::vector<Value> ReadSigmas(Scope& scope) const;

  Node entry;
  FormulaKeys keys;
  std::vector<Space> roles;  ///< those that are bound, then those that the sensor owns
  std::vector<Space> parts;  ///< of z
};

}  // namespace alidade::internal
