// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/model/plugin_abi.h"

namespace alidade {

enum class GeometryKind : std::uint32_t {
  kVector = ALIDADE_VECTOR,
  kAngle = ALIDADE_ANGLE,
  kUnitQuaternion = ALIDADE_UNIT_QUATERNION,
  kUnitVector = ALIDADE_UNIT_VECTOR,
  kProduct = ALIDADE_PRODUCT,
};
/// `vector`, `angle`, `unit_quaternion`, `unit_vector`, `product`.
const char* ToString(GeometryKind kind);

/// How far the length of a unit vector or quaternion that comes from outside may be off 1.
inline constexpr double kUnitTolerance = 1e-3;

/// A geometry of geometry.h with its size, chosen at run time.
struct Geometry {
  GeometryKind kind = GeometryKind::kVector;
  int ambient = 1;
  int tangent = 1;
  std::vector<Geometry> parts = {};  ///< of a product

  /// The geometries of geometry.h by name.
  static Geometry Vector(int size) { return {GeometryKind::kVector, size, size}; }
  static Geometry UnitQuaternion() { return {GeometryKind::kUnitQuaternion, 4, 3}; }
  static Geometry UnitVector() { return {GeometryKind::kUnitVector, 3, 2}; }
  static Geometry Angle() { return {GeometryKind::kAngle, 1, 1}; }
  static Geometry Product(std::vector<Geometry> parts);

  /// f(part, ambient offset, tangent offset) for each part of a product; of another geometry for
  /// itself.
  template <class F>
  void ForEachPart(const F& f) const {
    if (kind != GeometryKind::kProduct) return f(*this, 0, 0);
    int a = 0, t = 0;
    for (const Geometry& part : parts) {
      f(part, a, t);
      a += part.ambient;
      t += part.tangent;
    }
  }

  /// y = x (+) d; x and y may be the same. The result lies on the manifold to rounding.
  void Plus(const double* x, const double* d, double* y) const;
  /// d = y (-) x
  void Minus(const double* y, const double* x, double* d) const {
    if (kind != GeometryKind::kVector) return MinusCurved(y, x, d);
    for (int i = 0; i < ambient; ++i) d[i] = y[i] - x[i];
  }
  /// j (tangent x tangent, row-major): carries a tangent vector at `from` to the tangent space of
  /// `to` along the geodesic. The identity but for unit vectors, whose basis turns with the point.
  void Transport(const double* from, const double* to, double* j) const;
  /// The nearest point of the manifold; an angle is wrapped.
  void Normalise(double* x) const;
  /// The neutral element: zeros, (1, 0, 0, 0), (0, 0, 1).
  void Identity(double* x) const;

  friend bool operator==(const Geometry&, const Geometry&) = default;

 private:
  void MinusCurved(const double* y, const double* x, double* d) const;
};

/// j (tangent x tangent, row-major) = d(x (+) d)/dd, in the tangent space at x (+) d: the
/// identity for vectors and angles, and where d = 0.
void PlusJacobian(const Geometry& geometry, const double* x, const double* d, double* j);
/// Distance of x from the manifold: 0 for vectors, | |x| - 1 | for unit vectors and quaternions,
/// that of the farthest part for products.
double DistanceFrom(const Geometry& geometry, const double* x);
namespace internal {
void WrapAnglesOf(const Geometry& geometry, double* x);
}
/// Wraps what is an angle, and leaves the rest.
inline void WrapAngles(const Geometry& geometry, double* x) {
  if (geometry.kind != GeometryKind::kVector) internal::WrapAnglesOf(geometry, x);
}

/// `vector(3)`, `angle`, `unit_quaternion`, `unit_vector`, `product(vector(3), unit_quaternion)`.
std::string ToString(const Geometry& geometry);

/// A named quantity with its geometry: a role, a measurement, a control input, a state block.
struct Space {
  std::string name;
  std::string unit;
  std::string doc;
  std::vector<std::string> elements;  ///< names of the ambient elements; {""} for a single one
  Geometry geometry;
  unsigned flags = 0;                   ///< ALIDADE_ROLE_*
  std::vector<std::string> parts = {};  ///< names of those of a product

  bool optional() const { return (flags & ALIDADE_ROLE_OPTIONAL) != 0; }
  bool landmark() const { return (flags & ALIDADE_ROLE_LANDMARK) != 0; }
  bool shared() const { return (flags & ALIDADE_ROLE_SHARED) != 0; }
};

/// `name` or `name.element`, for each ambient element: the columns a value is written in.
std::vector<std::string> ColumnNames(const std::string& name, const Space& space);

}  // namespace alidade
