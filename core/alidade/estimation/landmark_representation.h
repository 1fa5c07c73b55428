// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "alidade/state/manifold.h"

/// Run-time selection of the representations in alidade/model/landmark.h.
namespace alidade {

enum class LandmarkRepresentation;  // in alidade/model/landmark.h

/// Returns the name in `landmarks.representation`: `inverse_depth`, `anchored` or `xyz`.
const char* ToString(LandmarkRepresentation representation);
/// Returns true for `xyz`, the representation by the point itself.
bool IsXyz(LandmarkRepresentation representation);
/// Returns the representation of the landmark roles among `roles`. Returns nothing if the sensor
/// defines its own representation: such landmarks are never converted, and their position is not
/// recorded.
std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles);

namespace internal {

/// The largest number of tangent elements of a representation.
inline constexpr int kMaxLandmarkTangent = 6;

/// Position of a landmark, with its Jacobian.
struct LandmarkPoint {
  Eigen::Vector3d position;  ///< in the world, m
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, 6>
      jacobian;  ///< of the position by the tangents of the blocks
};

/// Computes the position of a landmark from the values of its blocks, in the order of its roles.
/// Returns nothing unless the inverse distance is positive.
std::optional<LandmarkPoint> PointOf(LandmarkRepresentation representation,
                                     const double* const* blocks);

/// Returns the representation of landmarks that have converged.
LandmarkRepresentation XyzRepresentation();

/// Computes the linearity index of a landmark (LinearityIndex). `camera` is the position of the
/// camera in the world, m; `sigma` is the standard deviation of the inverse distance, 1/m.
double LinearityOf(LandmarkRepresentation representation, const double* const* blocks, double sigma,
                   const double* camera);

}  // namespace internal
}  // namespace alidade
