// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/model/plugin_abi.h"
#include "alidade/state/geometry_table.h"

namespace alidade {

/// The largest accepted difference from 1 of the length of a unit vector or quaternion that the
/// library did not compute itself.
inline constexpr double kUnitTolerance = 1e-3;

/// A geometry of alidade/model/geometry.h that is chosen at run time, with its size.
class Geometry {
 public:
  int ambient = 1;
  int tangent = 1;
  std::vector<Geometry> parts = {};  ///< of a product

  /// R^1
  Geometry() : Geometry(ALIDADE_VECTOR) {}
  /// The geometry with this number in the C table, which is not a product; `size`: of a vector.
  explicit Geometry(std::uint32_t number, int size = 1);
  /// The geometry of a struct of geometry.h; `size`: of a vector whose size is kDynamic.
  template <class G>
  static Geometry Of(int size = G::kAmbient) {
    return Geometry(G::kGeometry, size);
  }
  static Geometry Vector(int size) { return Geometry(ALIDADE_VECTOR, size); }
  static Geometry UnitQuaternion() { return Of<alidade::UnitQuaternion>(); }
  static Geometry UnitVector() { return Of<alidade::UnitVector>(); }
  static Geometry Angle() { return Of<alidade::Angle>(); }
  static Geometry Product(std::vector<Geometry> parts);

  /// The entry of the table of geometries.
  const GeometryRow& row() const { return *row_; }
  const char* name() const { return row_->name; }
  bool is_vector() const { return row_->number == ALIDADE_VECTOR; }
  bool is_product() const { return row_->number == ALIDADE_PRODUCT; }
  bool is_angle() const { return row_->number == ALIDADE_ANGLE; }
  /// True if the tangent basis turns with the point, so that a covariance turns with it; of a
  /// product: that of a part.
  bool has_transport() const;
  /// True if element `i` of a difference is an angle in rad.
  bool IsAngular(int i) const;
  /// True if all elements of a difference are.
  bool is_angular() const;

  /// Calls f(part, ambient offset, tangent offset) for each part of a product; for any other
  /// geometry once, for itself.
  template <class F>
  void ForEachPart(const F& f) const {
    if (!is_product()) return f(*this, 0, 0);
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
    if (!is_vector()) return MinusCurved(y, x, d);
    for (int i = 0; i < ambient; ++i) d[i] = y[i] - x[i];
  }
  /// Carries a tangent vector at `from` to the tangent space of `to` along the geodesic: writes j
  /// (tangent x tangent, row-major). It is the identity unless has_transport().
  void Transport(const double* from, const double* to, double* j) const;
  /// Moves x to the nearest point of the manifold; wraps an angle.
  void Normalise(double* x) const;
  /// The neutral element: zeros, (1, 0, 0, 0), (0, 0, 1).
  std::vector<double> Identity() const;

  friend bool operator==(const Geometry& a, const Geometry& b) {
    return a.row_->number == b.row_->number && a.ambient == b.ambient && a.parts == b.parts;
  }

 private:
  void MinusCurved(const double* y, const double* x, double* d) const;

  const GeometryRow* row_;  ///< in the table of the library, which outlives every plugin
};

/// j (tangent x tangent, row-major) = d(x (+) d)/dd, in the tangent space at x (+) d: the
/// identity for vectors, for angles, and at d = 0.
void PlusJacobian(const Geometry& geometry, const double* x, const double* d, double* j);
/// Distance of x from the manifold: 0 for vectors, | |x| - 1 | for unit vectors and quaternions,
/// that of the farthest part for products.
double DistanceFrom(const Geometry& geometry, const double* x);
/// Wraps each part of x that is an angle.
void WrapAngles(const Geometry& geometry, double* x);

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
  std::vector<std::string> parts = {};  ///< names of the parts of a product

  bool optional() const { return (flags & ALIDADE_ROLE_OPTIONAL) != 0; }
  bool landmark() const { return (flags & ALIDADE_ROLE_LANDMARK) != 0; }
  bool shared() const { return (flags & ALIDADE_ROLE_SHARED) != 0; }
};

/// `name` or `name.element` for each ambient element: the columns of a value.
std::vector<std::string> ColumnNames(const std::string& name, const Space& space);

}  // namespace alidade
