// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "alidade/model/euclidean_group.h"
#include "alidade/model/geometry.h"
#include "alidade/model/jet.h"

namespace alidade {

/// Entry of the table of geometries: the properties of a geometry, and its functions for doubles.
/// The entries of a vector and a product have no functions, because a model determines their sizes.
struct GeometryRow {
  std::uint32_t number = 0;  ///< number of the geometry in the plugin ABI
  const char* name = "";
  const char* elements = "";          ///< comma-separated element names of a value; "": numbers
  const char* tangent_elements = "";  ///< element names of a difference; "": equal to `elements`
  std::uint32_t angular = 0;          ///< bit i: element i of a difference is an angle in rad
  /// Index of the first element of a unit quaternion q in a value, q and -q being the same value.
  /// -1: the value contains no quaternion.
  int quaternion = -1;
  int ambient = 0, tangent = 0;  ///< sizes of a value and a difference; 0: set by the model
  const double* identity = nullptr;
  void (*plus)(const double* x, const double* d, double* y) = nullptr;
  void (*minus)(const double* y, const double* x, double* d) = nullptr;
  void (*normalise)(double* x) = nullptr;
  double (*distance)(const double* x) = nullptr;  ///< null: every x lies on the manifold
  /// Null: the transport matrix is the identity.
  void (*transport)(const double* x, const double* y, double* j) = nullptr;
  void (*plus_jacobian)(const double* x, const double* d, double* j) = nullptr;
  void (*plus_jacobian_x)(const double* x, const double* d, double* j) = nullptr;
};

namespace detail {

/// Computes j = dy/de. The derivative lies in the tangent space at y.
template <class G, class Dual>
void TangentDerivative(const Dual* y, double* j) {
  double base[G::kAmbient];
  Dual difference[G::kTangent];
  for (int i = 0; i < G::kAmbient; ++i) base[i] = y[i].a;
  G::Minus(y, base, difference);
  for (int i = 0; i < G::kTangent; ++i)
    std::copy_n(difference[i].v, G::kTangent, j + i * G::kTangent);
}

/// Computes j = d(x (+) (d + e))/de at e = 0 by dual numbers, in the tangent space at x (+) d.
template <class G>
void DifferentiatePlus(const double* x, const double* d, double* j) {
  using Dual = Jet<double, G::kTangent>;
  Dual dual_d[G::kTangent], y[G::kAmbient];
  for (int i = 0; i < G::kTangent; ++i) dual_d[i] = Dual(d[i], i);
  G::Plus(x, dual_d, y);
  TangentDerivative<G>(y, j);
}

/// Computes j = d((x (+) e) (+) d)/de at e = 0 likewise.
template <class G>
void DifferentiatePlusX(const double* x, const double* d, double* j) {
  using Dual = Jet<double, G::kTangent>;
  Dual e[G::kTangent], dual_x[G::kAmbient], y[G::kAmbient];
  for (int i = 0; i < G::kTangent; ++i) e[i] = Dual(0.0, i);
  G::Plus(x, e, dual_x);
  G::Plus(dual_x, d, y);
  TangentDerivative<G>(y, j);
}

/// Entry of the table for the struct G of alidade/model/geometry.h.
template <class G>
struct TypedRow : GeometryRow {
  using Type = G;

  constexpr explicit TypedRow(GeometryRow properties) : GeometryRow(properties) {
    number = G::kGeometry;
    ambient = G::kAmbient;
    tangent = G::kTangent;
    identity = G::kIdentity.data();
    plus = [](const double* x, const double* d, double* y) {
      double sum[G::kAmbient];  // a separate array, because y may be the same array as x
      G::Plus(x, d, sum);
      G::Normalise(sum);
      for (int i = 0; i < G::kAmbient; ++i) y[i] = sum[i];
    };
    minus = [](const double* y, const double* x, double* d) { G::Minus(y, x, d); };
    normalise = [](double* x) { G::Normalise(x); };
    if constexpr (requires(const double* x) { G::Distance(x); }) {
      distance = [](const double* x) -> double { return G::Distance(x); };
    }
    if constexpr (kHasTransport<G>) {
      transport = [](const double* x, const double* y, double* j) { G::Transport(x, y, j); };
    }
    if constexpr (requires(const double* x, double* j) { G::PlusJacobian(x, x, j); }) {
      plus_jacobian = [](const double* x, const double* d, double* j) { G::PlusJacobian(x, d, j); };
    } else {
      plus_jacobian = DifferentiatePlus<G>;
    }
    if constexpr (requires(const double* x, double* j) { G::PlusJacobianX(x, x, j); }) {
      plus_jacobian_x = [](const double* x, const double* d, double* j) {
        G::PlusJacobianX(x, d, j);
      };
    } else {
      plus_jacobian_x = DifferentiatePlusX<G>;
    }
  }
};

/// Entries of the geometries of a group, with the left-invariant and the right-invariant error.
inline constexpr GeometryRow kSe2Row{
    .elements = "x,y,theta", .tangent_elements = "dx,dy,dtheta", .angular = 0b100};
inline constexpr GeometryRow kSe3Row{.elements = "x,y,z,qw,qx,qy,qz",
                                     .tangent_elements = "dx,dy,dz,rx,ry,rz",
                                     .angular = 0b111000,
                                     .quaternion = 3};
inline constexpr GeometryRow kSe23Row{.elements = "x,y,z,qw,qx,qy,qz,vx,vy,vz",
                                      .tangent_elements = "dx,dy,dz,rx,ry,rz,dvx,dvy,dvz",
                                      .angular = 0b000111000,
                                      .quaternion = 3};
constexpr GeometryRow Named(GeometryRow row, const char* name) {
  row.name = name;
  return row;
}

/// All geometries of fixed size. To add a geometry, add a struct to alidade/model/geometry.h and an
/// entry here.
inline constexpr std::tuple kGeometries{
    TypedRow<Angle>({.name = "angle", .angular = 0b1}),
    TypedRow<UnitQuaternion>({.name = "unit_quaternion",
                              .elements = "w,x,y,z",
                              .tangent_elements = "rx,ry,rz",
                              .angular = 0b111,
                              .quaternion = 0}),
    TypedRow<UnitVector>(
        {.name = "unit_vector", .elements = "x,y,z", .tangent_elements = "d0,d1", .angular = 0b11}),
    TypedRow<LeftInvariant<Se2>>(Named(kSe2Row, "se_2_left")),
    TypedRow<RightInvariant<Se2>>(Named(kSe2Row, "se_2_right")),
    TypedRow<LeftInvariant<Se3>>(Named(kSe3Row, "se_3_left")),
    TypedRow<RightInvariant<Se3>>(Named(kSe3Row, "se_3_right")),
    TypedRow<LeftInvariant<Se23>>(Named(kSe23Row, "se_2_3_left")),
    TypedRow<RightInvariant<Se23>>(Named(kSe23Row, "se_2_3_right")),
};

inline constexpr GeometryRow kVectorRow{.number = ALIDADE_VECTOR, .name = "vector"};
inline constexpr GeometryRow kProductRow{.number = ALIDADE_PRODUCT, .name = "product"};

/// Entries of all geometries, including those whose size the model determines.
inline constexpr auto kGeometryRows = std::apply(
    [](const auto&... rows) {
      return std::array<const GeometryRow*, sizeof...(rows) + 2>{&kVectorRow, &rows...,
                                                                 &kProductRow};
    },
    kGeometries);

/// Largest number of tangent elements of a geometry of fixed size.
inline constexpr int kMaxTangent =
    std::apply([](const auto&... rows) { return std::max({rows.tangent...}); }, kGeometries);
static_assert(kMaxTangent <= 32, "GeometryRow::angular has 32 bits");

}  // namespace detail

/// Returns the entry of the geometry with this number in the plugin ABI, or null if the number is
/// unknown.
constexpr const GeometryRow* FindGeometry(std::uint32_t number) {
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->number == number) return row;
  }
  return nullptr;
}

/// Calls f(G{}) and returns true. G is the struct of the geometry with this number. For vectors and
/// products, which have no fixed size, returns false without calling f.
template <class F>
bool VisitGeometry(std::uint32_t number, const F& f) {
  const auto visit = [&](const auto& row) {
    if (row.number != number) return false;
    f(typename std::decay_t<decltype(row)>::Type{});
    return true;
  };
  return std::apply([&](const auto&... rows) { return (visit(rows) || ...); }, detail::kGeometries);
}

}  // namespace alidade
