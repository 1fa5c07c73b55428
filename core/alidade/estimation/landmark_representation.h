// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "alidade/state/manifold.h"

/// Functions that select a representation of alidade/model/landmark.h at run time.
namespace alidade {

enum class LandmarkRepresentation;  // defined in alidade/model/landmark.h

/// Returns the name of a representation in the key `landmarks.representation`: `inverse_depth`,
/// `anchored` or `xyz`.
const char* ToString(LandmarkRepresentation representation);
/// Returns true for `xyz`, the representation of a landmark by its coordinates.
bool IsXyz(LandmarkRepresentation representation);
/// Returns the representation of the landmark roles among `roles`. Returns nullopt if the sensor
/// defines its own representation. Landmarks of such a sensor are never converted, and their
/// positions are not recorded.
std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles);

namespace internal {

/// Largest number of tangent elements of a representation.
inline constexpr int kMaxLandmarkTangent = 6;

/// Position of a landmark, and the Jacobian of the position.
struct LandmarkPoint {
  Eigen::Vector3d position;  ///< in the world, m
  /// Derivative of the position with respect to the tangent elements of all blocks.
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxLandmarkTangent> jacobian;
};

/// Computes the position of a landmark from the values of its blocks, which are in the order of the
/// landmark roles. Returns nullopt unless the inverse distance is positive.
std::optional<LandmarkPoint> PointOf(LandmarkRepresentation representation,
                                     const double* const* blocks);

/// Returns the representation to which converged landmarks are converted: xyz.
LandmarkRepresentation XyzRepresentation();

/// Computes the linearity index of a landmark (LinearityIndex). `camera` is the position of the
/// camera in the world, m; `sigma` is the standard deviation of the inverse distance, 1/m.
double LinearityOf(LandmarkRepresentation representation, const double* const* blocks, double sigma,
                   const double* camera);

}  // namespace internal
}  // namespace alidade
