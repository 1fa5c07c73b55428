// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/manifold.h"

#include <algorithm>
#include <cmath>

#include "alidade/model/geometry.h"

namespace alidade {
namespace {

double Norm(const double* x, int size) {
  double sum = 0.0;
  for (int i = 0; i < size; ++i) sum += x[i] * x[i];
  return std::sqrt(sum);
}

void Scale(double factor, double* x, int size) {
  for (int i = 0; i < size; ++i) x[i] *= factor;
}

/// y = x (+) d by way of a buffer, so that y may be x, and kept on the manifold.
template <class G>
void UnitPlus(const double* x, const double* d, double* y) {
  double sum[G::kAmbient];
  G::Plus(x, d, sum);
  alidade::Normalise<G>(sum);
  std::copy_n(sum, G::kAmbient, y);
}

/// The right Jacobian of SO(3), with t = |d|:
///
///   J = I - (1 - cos t) / t^2 [d]x + (t - sin t) / t^3 [d]x^2     [Sola2017] eq. 183
///
/// where [d]x^2 = d d' - t^2 I.
void RightJacobian(const double* d, double* j) {
  const double t2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], t = std::sqrt(t2);
  constexpr double kSeries = 1e-4;
  const double a = t < kSeries ? 0.5 - t2 / 24.0 : (1.0 - std::cos(t)) / t2;
  const double b = t < kSeries ? 1.0 / 6.0 - t2 / 120.0 : (t - std::sin(t)) / (t2 * t);
  const double cross[9] = {0.0, -d[2], d[1], d[2], 0.0, -d[0], -d[1], d[0], 0.0};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double one = row == column ? 1.0 : 0.0;
      j[3 * row + column] = one - a * cross[3 * row + column] + b * (d[row] * d[column] - t2 * one);
    }
  }
}

/// Derivative of the exponential map of S^2: along d nothing is stretched, across it lengths go
/// with sin |d| / |d|; then what geodesic transport makes of both.
void UnitVectorPlusJacobian(const double* x, const double* d, double* j) {
  const double t2 = d[0] * d[0] + d[1] * d[1], t = std::sqrt(t2);
  constexpr double kSeries = 1e-4;
  const double s = t < kSeries ? 1.0 - t2 / 6.0 : std::sin(t) / t;
  const double k = t < kSeries ? 1.0 / 6.0 : (1.0 - s) / t2;  // of d d'
  double y[3], transport[4];
  UnitPlus<UnitVector>(x, d, y);
  UnitVector::Transport(x, y, transport);
  for (int row = 0; row < 2; ++row) {
    const double along = transport[2 * row] * d[0] + transport[2 * row + 1] * d[1];
    for (int column = 0; column < 2; ++column) {
      j[2 * row + column] = s * transport[2 * row + column] + k * along * d[column];
    }
  }
}

void Identity(int size, double* j) {
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) j[row * size + column] = row == column;
  }
}

}  // namespace

const char* ToString(GeometryKind kind) {
  switch (kind) {
    case GeometryKind::kVector:
      return "vector";
    case GeometryKind::kAngle:
      return "angle";
    case GeometryKind::kUnitQuaternion:
      return "unit_quaternion";
    case GeometryKind::kUnitVector:
      break;
  }
  return "unit_vector";
}

std::string ToString(const Geometry& geometry) {
  const std::string name = ToString(geometry.kind);
  return geometry.kind == GeometryKind::kVector
             ? name + '(' + std::to_string(geometry.ambient) + ')'
             : name;
}

void Geometry::Plus(const double* x, const double* d, double* y) const {
  switch (kind) {
    case GeometryKind::kVector:
      return Vec<kDynamic>::Plus(x, d, y, ambient);
    case GeometryKind::kAngle:
      return alidade::Angle::Plus(x, d, y);
    case GeometryKind::kUnitQuaternion:
      return UnitPlus<alidade::UnitQuaternion>(x, d, y);
    case GeometryKind::kUnitVector:
      return UnitPlus<alidade::UnitVector>(x, d, y);
  }
}

void Geometry::Minus(const double* y, const double* x, double* d) const {
  switch (kind) {
    case GeometryKind::kVector:
      return Vec<kDynamic>::Minus(y, x, d, ambient);
    case GeometryKind::kAngle:
      return alidade::Angle::Minus(y, x, d);
    case GeometryKind::kUnitQuaternion:
      return alidade::UnitQuaternion::Minus(y, x, d);
    case GeometryKind::kUnitVector:
      return alidade::UnitVector::Minus(y, x, d);
  }
}

void Geometry::Transport(const double* from, const double* to, double* j) const {
  if (kind == GeometryKind::kUnitVector) return alidade::UnitVector::Transport(from, to, j);
  alidade::Identity(tangent, j);
}

void Geometry::PlusJacobian(const double* x, const double* d, double* j) const {
  if (kind == GeometryKind::kUnitQuaternion) return RightJacobian(d, j);
  if (kind == GeometryKind::kUnitVector) return UnitVectorPlusJacobian(x, d, j);
  alidade::Identity(tangent, j);
}

double Geometry::Defect(const double* x) const {
  const bool unit = kind == GeometryKind::kUnitQuaternion || kind == GeometryKind::kUnitVector;
  return unit ? std::abs(Norm(x, ambient) - 1.0) : 0.0;
}

void Geometry::Normalise(double* x) const {
  if (kind == GeometryKind::kAngle) x[0] = alidade::Angle::Wrap(x[0]);
  if (Defect(x) == 0.0) return;
  const double norm = Norm(x, ambient);
  if (norm > 0.0) {
    Scale(1.0 / norm, x, ambient);
  } else {
    Identity(x);
  }
}

void Geometry::Identity(double* x) const {
  std::fill_n(x, ambient, 0.0);
  if (kind == GeometryKind::kUnitQuaternion) x[0] = 1.0;
  if (kind == GeometryKind::kUnitVector) x[2] = 1.0;
}

std::vector<std::string> ColumnNames(const std::string& name, const Space& space) {
  std::vector<std::string> columns;
  for (const std::string& element : space.elements) {
    columns.push_back(element.empty() ? name : name + '.' + element);
  }
  return columns;
}

}  // namespace alidade
