// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace alidade::ceres_batch {

/// A landmark as a function of the camera at its first observation k and of inputs l ~ N(0, I):
///
///   y = g(x_k, z_k (+) L_k l_z, rho0 + sigma l_rho)     by the sensor's own Initialise
///   y = m + sigma l                                     where it is known beforehand
///
/// So it has the information of the filter's initialisation: the observation k is consumed by it,
/// an anchor is the camera itself, and the prior of the inverse distance counts once.
struct MapLandmark {
  /// A factor of a frame.
  struct Observation {
    std::size_t epoch = 0, factor = 0;
  };
  std::int64_t id = -1;
  int generation = 0;                     ///< landmarks of this id before it
  std::optional<Observation> first;       ///< none: known
  std::vector<Observation> observations;  ///< in their order, without the first
  double prior = 0.0;                     ///< rho0, 1/m
  double sigma = 0.0;                     ///< of rho0; known: of m; 0: exact
  std::vector<double> mean;               ///< m, where known
  Eigen::VectorXd from;                   ///< l that a search starts from
  Eigen::VectorXd l;                      ///< found last
  std::vector<double> y;                  ///< its value there, ambient, one role after the other
};

/// The values x of a state and, behind, y of a landmark.
inline std::vector<double> WithLandmark(std::vector<double> x, const std::vector<double>& y) {
  x.insert(x.end(), y.begin(), y.end());
  return x;
}

}  // namespace alidade::ceres_batch
