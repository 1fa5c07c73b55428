// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Number in the config that a filter assumes to be known: a standard deviation, the time offset of
/// a sensor, or an element of a constant block.
struct FilterParameter {
  std::string key;             ///< key of the number or of its list, as in `sensors.gnss.sigma_m`
  std::vector<double> values;  ///< the number, or all numbers of the list
  std::size_t element = 0;     ///< index of the number in the list
  bool is_list = false;
  bool is_deviation = false;  ///< a standard deviation, whose logarithm is the tested quantity

  double value() const { return values[element]; }
  /// Returns the key of the number, as in `sensors.mocap.sigma_position_m[2]`.
  std::string name() const;
  /// Returns `value` as YAML for the key. If the key has a list, its other numbers are unchanged.
  std::string YamlOf(double value) const;
};

/// Returns the parameters of the sensors and motion models of a filter, in the order of the config:
///
///   sigma*, noise.*, random_walk    standard deviations and noise densities, not those of priors
///   sensors.NAME.time_offset_s      if it is a number; 0 if it is missing
///   initial.BLOCK.mean              of the blocks in the list `constant`
///
/// `root` is the root of the config with the overrides of the filter. `problem` is the problem of
/// the filter. A default value that the config does not contain is not a parameter.
std::vector<FilterParameter> FilterParametersOf(const Node& root, const Problem& problem);

}  // namespace alidade::internal
