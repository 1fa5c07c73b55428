// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "alidade/system/landmark_form.h"

/// The representations of alidade/model/landmark.h, chosen at run time. `blocks` are the values of
/// the blocks of a landmark, in the order of its roles.
namespace alidade::internal {

struct LandmarkPoint {
  Eigen::Vector3d position;                           ///< in the world, m
  Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian;  ///< by the tangents of the blocks
};

/// The landmark as xyz; none unless its inverse distance is above 0.
std::optional<LandmarkPoint> PointOf(LandmarkRepresentation representation,
                                     const double* const* blocks);

/// The representation of landmarks that have converged.
LandmarkRepresentation XyzRepresentation();

/// Its index of linearity, as seen from `camera` in the world, m; `sigma` is that of the inverse
/// distance.
double LinearityOf(LandmarkRepresentation representation, const double* const* blocks, double sigma,
                   const double* camera);

}  // namespace alidade::internal
