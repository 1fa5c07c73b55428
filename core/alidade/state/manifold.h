// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/model/plugin_abi.h"
#include "alidade/state/geometry_table.h"

namespace alidade {

/// Largest accepted difference between 1 and the length of a unit vector or quaternion that a user
/// of the library provides.
inline constexpr double kUnitTolerance = 1e-3;

/// Geometry of alidade/model/geometry.h that is selected at run time, with its size.
class Geometry {
 public:
  int ambient = 1;
  int tangent = 1;
  std::vector<Geometry> parts = {};  ///< parts of a product

  /// Constructs R^1.
  Geometry() : Geometry(ALIDADE_VECTOR) {}
  /// Constructs the geometry with this number in the plugin ABI, which must not be a product.
  /// `size` is used only for a vector.
  explicit Geometry(std::uint32_t number, int size = 1);
  /// Returns the geometry of the struct G of geometry.h. `size` is the size of a vector whose size
  /// is known only at run time (kDynamic).
  template <class G>
  static Geometry Of(int size = G::kAmbient) {
    return Geometry(G::kGeometry, size);
  }
  static Geometry Vector(int size) { return Geometry(ALIDADE_VECTOR, size); }
  static Geometry UnitQuaternion() { return Of<alidade::UnitQuaternion>(); }
  static Geometry UnitVector() { return Of<alidade::UnitVector>(); }
  static Geometry Angle() { return Of<alidade::Angle>(); }
  static Geometry Product(std::vector<Geometry> parts);

  /// Returns the entry in the table of geometries.
  const GeometryRow& row() const { return *row_; }
  const char* name() const { return row_->name; }
  bool is_vector() const { return row_->number == ALIDADE_VECTOR; }
  bool is_product() const { return row_->number == ALIDADE_PRODUCT; }
  bool is_angle() const { return row_->number == ALIDADE_ANGLE; }
  /// Returns true if the basis of the tangent space rotates when the point moves. A covariance must
  /// then be transported. For a product, returns true if this holds for any part.
  bool has_transport() const;
  /// Returns true if element `i` of a difference is an angle in rad.
  bool IsAngular(int i) const;
  /// Returns true if all elements of a difference are angles.
  bool is_angular() const;

  /// Calls f(part, ambient offset, tangent offset) for each part of a product. For any other
  /// geometry, calls f once with the geometry itself.
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

  /// Computes y = x (+) d; x and y may be the same array. The result lies on the manifold within
  /// rounding errors.
  void Plus(const double* x, const double* d, double* y) const;
  /// Computes d = y (-) x.
  void Minus(const double* y, const double* x, double* d) const {
    if (!is_vector()) return MinusCurved(y, x, d);
    for (int i = 0; i < ambient; ++i) d[i] = y[i] - x[i];
  }
  /// Computes the matrix j (tangent x tangent, row-major) that transports a tangent vector at x
  /// along the geodesic to the tangent space of y. The matrix is the identity unless
  /// has_transport() is true.
  void Transport(const double* x, const double* y, double* j) const;
  /// Moves x to the nearest point of the manifold. Wraps angles.
  void Normalise(double* x) const;
  /// Returns the neutral element: zeros for a vector or an angle, (1, 0, 0, 0) for a quaternion,
  /// (0, 0, 1) for a unit vector.
  std::vector<double> Identity() const;

  friend bool operator==(const Geometry& a, const Geometry& b) {
    return a.row_->number == b.row_->number && a.ambient == b.ambient && a.parts == b.parts;
  }

 private:
  void MinusCurved(const double* y, const double* x, double* d) const;

  const GeometryRow* row_;  ///< entry in the table of the library, which outlives every plugin
};

/// Computes j = d(x (+) d)/dd (tangent x tangent, row-major), in the tangent space at x (+) d. The
/// matrix is the identity for vectors, for angles, and at d = 0.
void PlusJacobian(const Geometry& geometry, const double* x, const double* d, double* j);
/// Computes j = d(x (+) d)/dx likewise: the derivative with respect to a tangent vector at x.
void PlusJacobianX(const Geometry& geometry, const double* x, const double* d, double* j);
/// Returns the distance of x from the manifold: 0 for vectors, | |x| - 1 | for unit vectors and
/// quaternions, the largest distance of a part for products.
double DistanceFrom(const Geometry& geometry, const double* x);
namespace internal {
void WrapParts(const Geometry& geometry, double* x);
}
/// Wraps the angles of x. Does not change unit vectors and quaternions.
inline void WrapAngles(const Geometry& geometry, double* x) {
  if (!geometry.is_vector()) internal::WrapParts(geometry, x);
}

/// Returns the name of a geometry, such as `vector(3)`, `angle` or `product(vector(3),
/// unit_quaternion)`.
std::string ToString(const Geometry& geometry);

/// Named quantity with its geometry: a role, a measurement, a control input or a state block.
struct Space {
  std::string name;
  std::string unit;
  std::string doc;
  std::vector<std::string> elements;  ///< names of the ambient elements; {""} for a scalar
  Geometry geometry;
  unsigned flags = 0;                        ///< ALIDADE_ROLE_*
  std::vector<std::string> parts = {};       ///< names of the parts of a product
  std::vector<std::string> part_units = {};  ///< units of the parts of a product

  bool optional() const { return (flags & ALIDADE_ROLE_OPTIONAL) != 0; }
  bool landmark() const { return (flags & ALIDADE_ROLE_LANDMARK) != 0; }
  bool shared() const { return (flags & ALIDADE_ROLE_SHARED) != 0; }
};

/// Returns the column names of a value: `name.element` for each ambient element, or `name` for an
/// element without a name.
std::vector<std::string> ColumnNames(const std::string& name, const Space& space);

}  // namespace alidade
