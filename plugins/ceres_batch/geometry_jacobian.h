// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>

#include "alidade/geometry.h"
#include "alidade/space.h"

namespace alidade::ceres_batch {

/// d(m (+) d)/dd in the tangent at m (+) d, and d(z (-) h)/dh in the tangent at h, by dual numbers.
template <class G>
struct GeometryJacobian {
  static constexpr int kAmbient = G::kAmbient, kTangent = G::kTangent;
  using Jet = ceres::Jet<double, kTangent>;
  using Jacobian = Eigen::Matrix<double, kTangent, kTangent>;

  static Jacobian Plus(const double* m, const double* d) {
    double x[kAmbient];
    G::Plus(m, d, x);
    Jet moved_d[kTangent], moved_x[kAmbient], difference[kTangent];
    for (int i = 0; i < kTangent; ++i) moved_d[i] = Jet(d[i], i);
    G::Plus(m, moved_d, moved_x);
    G::Minus(moved_x, x, difference);
    return PartsOf(difference);
  }
  static Jacobian Minus(const double* z, const double* h) {
    Jet d[kTangent], moved_h[kAmbient], difference[kTangent];
    for (int i = 0; i < kTangent; ++i) d[i] = Jet(0.0, i);
    G::Plus(h, d, moved_h);
    G::Minus(z, moved_h, difference);
    return PartsOf(difference);
  }

 private:
  static Jacobian PartsOf(const Jet* values) {
    Jacobian j;
    for (int i = 0; i < kTangent; ++i) j.row(i) = values[i].v.transpose();
    return j;
  }
};

/// d(m (+) d)/dd, t x t for tangent size t.
inline Eigen::MatrixXd PlusJacobian(const Geometry& geometry, const double* m, const double* d) {
  switch (geometry.kind) {
    case GeometryKind::kUnitQuaternion:
      return GeometryJacobian<UnitQuaternion>::Plus(m, d);
    case GeometryKind::kUnitVector:
      return GeometryJacobian<UnitVector>::Plus(m, d);
    case GeometryKind::kVector:
    case GeometryKind::kAngle:
      break;
  }
  return Eigen::MatrixXd::Identity(geometry.tangent, geometry.tangent);
}

/// d(z (-) h)/dh, t x t for tangent size t.
inline Eigen::MatrixXd MinusJacobian(const Geometry& geometry, const double* z, const double* h) {
  switch (geometry.kind) {
    case GeometryKind::kUnitQuaternion:
      return GeometryJacobian<UnitQuaternion>::Minus(z, h);
    case GeometryKind::kUnitVector:
      return GeometryJacobian<UnitVector>::Minus(z, h);
    case GeometryKind::kVector:
    case GeometryKind::kAngle:
      break;
  }
  return -Eigen::MatrixXd::Identity(geometry.tangent, geometry.tangent);
}

}  // namespace alidade::ceres_batch
