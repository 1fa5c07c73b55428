// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "alidade/state/manifold.h"

/// Which of the representations of alidade/model/landmark.h a landmark is written in, where that is
/// known at run time only.
namespace alidade {

enum class LandmarkRepresentation;  // in alidade/model/landmark.h

/// `inverse_depth`, `anchored`, `xyz`: the choices of `landmarks.representation`.
const char* ToString(LandmarkRepresentation representation);
/// Whether it is the representation `xyz`, the point itself.
bool IsXyz(LandmarkRepresentation representation);
/// The representation that these roles write, of which those that are no landmark's do not count.
/// None: such landmarks are never converted, and have no place in the record.
std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles);

namespace internal {

struct LandmarkPoint {
  Eigen::Vector3d position;                                                  ///< in the world, m
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, 6> jacobian;  ///< by their tangents
};

/// The landmark as xyz, from the values of its blocks in the order of its roles; none unless its
/// inverse distance is above 0.
std::optional<LandmarkPoint> PointOf(LandmarkRepresentation representation,
                                     const double* const* blocks);

/// The representation of landmarks that have converged.
LandmarkRepresentation XyzRepresentation();

/// Its index of linearity, as seen from `camera` in the world, m; `sigma` is that of the inverse
/// distance.
double LinearityOf(LandmarkRepresentation representation, const double* const* blocks, double sigma,
                   const double* camera);

}  // namespace internal
}  // namespace alidade
