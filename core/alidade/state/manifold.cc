// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/manifold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

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

/// j, of a whole of `size`: the identity, but for the parts whose own Jacobian by(part, a, own) is
/// none.
template <class By>
void ByParts(const Geometry& whole, double* j, const By& by) {
  const int size = whole.tangent;
  Identity(size, j);
  whole.ForEachPart([&](const Geometry& part, int a, int t) {
    if (part.ambient == part.tangent) return;  // a vector or an angle
    std::array<double, 9> own;
    by(part, a, t, own.data());
    for (int row = 0; row < part.tangent; ++row) {
      std::copy_n(own.data() + row * part.tangent, part.tangent, j + (t + row) * size + t);
    }
  });
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
      return "unit_vector";
    case GeometryKind::kProduct:
      break;
  }
  return "product";
}

std::string ToString(const Geometry& geometry) {
  std::string name = ToString(geometry.kind);
  if (geometry.kind == GeometryKind::kVector) {
    name += '(' + std::to_string(geometry.ambient) + ')';
  } else if (geometry.kind == GeometryKind::kProduct) {
    for (const Geometry& part : geometry.parts) {
      name += (&part == &geometry.parts.front() ? "(" : ", ") + ToString(part);
    }
    name += ')';
  }
  return name;
}

Geometry Geometry::Product(std::vector<Geometry> parts) {
  Geometry whole{GeometryKind::kProduct, 0, 0, std::move(parts)};
  for (const Geometry& part : whole.parts) {
    whole.ambient += part.ambient;
    whole.tangent += part.tangent;
  }
  return whole;
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
    case GeometryKind::kProduct:
      return ForEachPart(
          [&](const Geometry& part, int a, int t) { part.Plus(x + a, d + t, y + a); });
  }
}

void Geometry::MinusCurved(const double* y, const double* x, double* d) const {
  switch (kind) {
    case GeometryKind::kVector:
      return Vec<kDynamic>::Minus(y, x, d, ambient);
    case GeometryKind::kAngle:
      return alidade::Angle::Minus(y, x, d);
    case GeometryKind::kUnitQuaternion:
      return alidade::UnitQuaternion::Minus(y, x, d);
    case GeometryKind::kUnitVector:
      return alidade::UnitVector::Minus(y, x, d);
    case GeometryKind::kProduct:
      return ForEachPart(
          [&](const Geometry& part, int a, int t) { part.Minus(y + a, x + a, d + t); });
  }
}

void Geometry::Transport(const double* from, const double* to, double* j) const {
  if (kind == GeometryKind::kUnitVector) return alidade::UnitVector::Transport(from, to, j);
  ByParts(*this, j, [&](const Geometry& part, int a, int, double* own) {
    part.kind == GeometryKind::kUnitVector ? part.Transport(from + a, to + a, own)
                                           : alidade::Identity(part.tangent, own);
  });
}

void PlusJacobian(const Geometry& geometry, const double* x, const double* d, double* j) {
  if (geometry.kind == GeometryKind::kUnitQuaternion) return RightJacobian(d, j);
  if (geometry.kind == GeometryKind::kUnitVector) return UnitVectorPlusJacobian(x, d, j);
  ByParts(geometry, j, [&](const Geometry& part, int a, int t, double* own) {
    PlusJacobian(part, x + a, d + t, own);
  });
}

double DistanceFrom(const Geometry& geometry, const double* x) {
  if (geometry.kind == GeometryKind::kProduct) {
    double worst = 0.0;
    geometry.ForEachPart([&](const Geometry& part, int a, int) {
      const double defect = DistanceFrom(part, x + a);
      if (!(defect <= worst)) worst = defect;
    });
    return worst;
  }
  const bool unit =
      geometry.kind == GeometryKind::kUnitQuaternion || geometry.kind == GeometryKind::kUnitVector;
  return unit ? std::abs(Norm(x, geometry.ambient) - 1.0) : 0.0;
}

void Geometry::Normalise(double* x) const {
  if (kind == GeometryKind::kProduct) {
    return ForEachPart([&](const Geometry& part, int a, int) { part.Normalise(x + a); });
  }
  if (kind == GeometryKind::kAngle) x[0] = alidade::Angle::Wrap(x[0]);
  if (DistanceFrom(*this, x) == 0.0) return;
  const double norm = Norm(x, ambient);
  if (norm == 0.0) {
    Identity(x);
  } else {  // not a number stays none
    Scale(1.0 / norm, x, ambient);
  }
}

void internal::WrapAnglesOf(const Geometry& geometry, double* x) {
  geometry.ForEachPart([&](const Geometry& part, int a, int) {
    if (part.kind == GeometryKind::kAngle) x[a] = alidade::Angle::Wrap(x[a]);
  });
}

void Geometry::Identity(double* x) const {
  if (kind == GeometryKind::kProduct) {
    return ForEachPart([&](const Geometry& part, int a, int) { part.Identity(x + a); });
  }
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
