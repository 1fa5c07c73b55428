// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "alidade/state/manifold.h"

/// The representations of alidade/model/landmark.h, chosen at run time.
namespace alidade {

enum class LandmarkRepresentation;  // in alidade/model/landmark.h

/// `inverse_depth`, `anchored`, `xyz`: the choices of `landmarks.representation`.
const char* ToString(LandmarkRepresentation representation);
/// Returns true for the representation `xyz`, the point itself.
bool IsXyz(LandmarkRepresentation representation);
/// The representation of the landmark roles among these. Returns nothing if they are of a sensor's
/// own representation: such landmarks are never converted, and their position is not recorded.
std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles);

namespace internal {

/// The largest number of tangent elements of a representation.
inline constexpr int kMaxLandmarkTangent = 6;

/// A landmark as xyz.
struct LandmarkPoint {
  Eigen::Vector3d position;  ///< in the world, m
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, 6>
      jacobian;  ///< by the tangents of the blocks
};

/// The landmark as xyz, from the values of its blocks in the order of its roles. Returns nothing
/// unless its inverse distance is positive.
std::optional<LandmarkPoint> PointOf(LandmarkRepresentation representation,
                                     const double* const* blocks);

/// The representation of landmarks that have converged.
LandmarkRepresentation XyzRepresentation();

/// The linearity index of a landmark for a camera at `camera` in the world, m; `sigma` is that of
/// the inverse distance.
double LinearityOf(LandmarkRepresentation representation, const double* const* blocks, double sigma,
                   const double* camera);

}  // namespace internal
}  // namespace alidade
