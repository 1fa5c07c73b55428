// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>

#include "alidade/geometry.h"
#include "alidade/space.h"

namespace alidade::ceres_batch {

/// d(z (-) h)/dh in the tangent at h, by dual numbers.
template <class G>
Eigen::MatrixXd MinusJacobianOf(const double* z, const double* h) {
  using Jet = ceres::Jet<double, G::kTangent>;
  Jet d[G::kTangent], moved_h[G::kAmbient], difference[G::kTangent];
  for (int i = 0; i < G::kTangent; ++i) d[i] = Jet(0.0, i);
  G::Plus(h, d, moved_h);
  G::Minus(z, moved_h, difference);
  Eigen::MatrixXd j(G::kTangent, G::kTangent);
  for (int i = 0; i < G::kTangent; ++i) j.row(i) = difference[i].v.transpose();
  return j;
}

/// d(z (-) h)/dh, t x t for tangent size t.
inline Eigen::MatrixXd MinusJacobian(const Geometry& geometry, const double* z, const double* h) {
  switch (geometry.kind) {
    case GeometryKind::kUnitQuaternion:
      return MinusJacobianOf<UnitQuaternion>(z, h);
    case GeometryKind::kUnitVector:
      return MinusJacobianOf<UnitVector>(z, h);
    case GeometryKind::kVector:
    case GeometryKind::kAngle:
      break;
  }
  return -Eigen::MatrixXd::Identity(geometry.tangent, geometry.tangent);
}

}  // namespace alidade::ceres_batch
