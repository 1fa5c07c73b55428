// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "alidade/model/geometry.h"
#include "alidade/model/jet.h"

namespace alidade {

/// A geometry as it is used at run time: its facts, and its functions on doubles. A vector and a
/// product have no functions here, because the model determines their sizes.
struct GeometryRow {
  std::uint32_t number = 0;  ///< in the C table
  const char* name = "";
  const char* elements = "";          ///< of a value, comma separated; "" for numbers
  const char* tangent_elements = "";  ///< of a difference; "" for the same as `elements`
  std::uint32_t angular = 0;          ///< bit i: element i of a difference is an angle in rad
  bool double_cover = false;          ///< true if x and -x are one value
  int ambient = 0, tangent = 0;       ///< sizes of a value and of a difference; 0: the model's
  const double* identity = nullptr;
  void (*plus)(const double* x, const double* d, double* y) = nullptr;
  void (*minus)(const double* y, const double* x, double* d) = nullptr;
  void (*normalise)(double* x) = nullptr;
  double (*distance)(const double* x) = nullptr;  ///< null: every x is a point of the manifold
  void (*transport)(const double* from, const double* to, double* j) = nullptr;  ///< null: identity
  void (*plus_jacobian)(const double* x, const double* d, double* j) = nullptr;
};

namespace detail {

/// j = d(x (+) (d + e))/de at e = 0, in the tangent space at x (+) d, by dual numbers.
template <class G>
void DifferentiatePlus(const double* x, const double* d, double* j) {
  using Dual = Jet<double, G::kTangent>;
  Dual moved[G::kTangent], y[G::kAmbient], difference[G::kTangent];
  double base[G::kAmbient];
  for (int i = 0; i < G::kTangent; ++i) moved[i] = Dual(d[i], i);
  G::Plus(x, moved, y);
  for (int i = 0; i < G::kAmbient; ++i) base[i] = y[i].a;
  G::Minus(y, base, difference);
  for (int i = 0; i < G::kTangent; ++i) {
    for (int k = 0; k < G::kTangent; ++k) j[i * G::kTangent + k] = difference[i].v[k];
  }
}

/// The row of the struct G of alidade/model/geometry.h.
template <class G>
struct TypedRow : GeometryRow {
  using Type = G;

  constexpr explicit TypedRow(GeometryRow facts) : GeometryRow(facts) {
    number = G::kGeometry;
    ambient = G::kAmbient;
    tangent = G::kTangent;
    identity = G::kIdentity.data();
    plus = [](const double* x, const double* d, double* y) {
      double sum[G::kAmbient];  // y may be x
      G::Plus(x, d, sum);
      G::Normalise(sum);
      for (int i = 0; i < G::kAmbient; ++i) y[i] = sum[i];
    };
    minus = [](const double* y, const double* x, double* d) { G::Minus(y, x, d); };
    normalise = G::Normalise;
    if constexpr (requires { &G::Distance; }) distance = G::Distance;
    if constexpr (kHasTransport<G>) transport = G::Transport;
    if constexpr (requires { &G::PlusJacobian; }) {
      plus_jacobian = G::PlusJacobian;
    } else {
      plus_jacobian = DifferentiatePlus<G>;
    }
  }
};

/// All geometries of fixed size. A new one is a struct in alidade/model/geometry.h and a row here.
inline constexpr std::tuple kGeometries{
    TypedRow<Angle>({.name = "angle", .angular = 0b1}),
    TypedRow<UnitQuaternion>({.name = "unit_quaternion",
                              .elements = "w,x,y,z",
                              .tangent_elements = "rx,ry,rz",
                              .angular = 0b111,
                              .double_cover = true}),
    TypedRow<UnitVector>(
        {.name = "unit_vector", .elements = "x,y,z", .tangent_elements = "d0,d1", .angular = 0b11}),
};

inline constexpr GeometryRow kVectorRow{.number = ALIDADE_VECTOR, .name = "vector"};
inline constexpr GeometryRow kProductRow{.number = ALIDADE_PRODUCT, .name = "product"};

/// The rows of all geometries, those of the model's size too.
inline constexpr auto kGeometryRows = std::apply(
    [](const auto&... rows) {
      return std::array<const GeometryRow*, sizeof...(rows) + 2>{&kVectorRow, &rows...,
                                                                 &kProductRow};
    },
    kGeometries);

/// The largest number of tangent elements of a geometry of fixed size.
inline constexpr int kMaxTangent =
    std::apply([](const auto&... rows) { return std::max({rows.tangent...}); }, kGeometries);

}  // namespace detail

/// The row of a geometry by its number in the C table; null if there is none.
constexpr const GeometryRow* FindGeometry(std::uint32_t number) {
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->number == number) return row;
  }
  return nullptr;
}

/// Calls f(G{}) with the struct G of the geometry of fixed size that has this number. Returns false,
/// and calls nothing, for a vector and a product.
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
