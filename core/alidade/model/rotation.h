// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

/// Rotation group SO(3): the Jacobians of its exponential map. UnitQuaternion in
/// alidade/model/geometry.h contains Exp, Log and the rotation of a vector. All matrices are
/// row-major. The scalar type T is double or a dual number.
namespace alidade {

/// Stumpff functions of x = t^2 >= 0:
///
///   c_n(x) = 1/n! - x/(n + 2)! + x^2/(n + 4)! - ...
///   c_0 = cos t,   c_1 = sin t / t,   c_2 = (1 - cos t) / t^2,   c_3 = (t - sin t) / t^3
///   c_n = 1/n! - x c_(n+2)
///
/// They are smooth at t = 0, and so are the coefficients of all formulas of a Euclidean group.
/// Source: [Stumpff1959].
template <class T>
struct StumpffFunctions {
  T c0, c1, c2, c3, c4, c5;

  explicit StumpffFunctions(const T& x) {
    if (x < T(1.0)) {
      // The first neglected term is below the rounding error.
      constexpr int kTerms = 8;
      c4 = c5 = T(1.0);
      for (int k = kTerms; k > 0; --k) {
        const double n = 2.0 * k;
        c4 = 1.0 - c4 * x / ((n + 3.0) * (n + 4.0));
        c5 = 1.0 - c5 * x / ((n + 4.0) * (n + 5.0));
      }
      c4 = c4 / 24.0;
      c5 = c5 / 120.0;
      c3 = 1.0 / 6.0 - x * c5;
      c2 = 0.5 - x * c4;
      c1 = 1.0 - x * c3;
      c0 = 1.0 - x * c2;
      return;
    }
    using std::cos;
    using std::sin;
    using std::sqrt;
    const T t = sqrt(x);
    c0 = cos(t);
    c1 = sin(t) / t;
    c2 = (1.0 - c0) / x;
    c3 = (1.0 - c1) / x;
    c4 = (0.5 - c2) / x;
    c5 = (1.0 / 6.0 - c3) / x;
  }
};

/// Jacobians of SO(3). d is a rotation vector in rad, t = |d|.
///
///   Exp(d + e) = Exp(J_l e) Exp(d) = Exp(d) Exp(J_r e)        for small e
///   J_l(d)     = I + c_2 [d]x + c_3 [d]x^2,   c_n = c_n(t^2)  [Sola2018] eq. 145
///   J_r(d)     = J_l(-d)                                      [Sola2018] eq. 143
///   J_l(d)^-1  = I - [d]x / 2 + k [d]x^2,   k = (1 - t/2 cot t/2) / t^2
struct Rotation {
  /// Computes m = I + a [d]x + b [d]x^2.
  template <class T>
  static void Polynomial(const T* d, const T& a, const T& b, T* m) {
    const T x = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) m[3 * row + column] = b * d[row] * d[column];
      m[4 * row] += 1.0 - b * x;
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      m[3 * k + j] += a * d[i];
      m[3 * j + k] -= a * d[i];
    }
  }
  template <class T>
  static void LeftJacobian(const T* d, T* j) {
    const StumpffFunctions<T> s(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    Polynomial(d, s.c2, s.c3, j);
  }
  template <class T>
  static void RightJacobian(const T* d, T* j) {
    const T minus_d[3] = {-d[0], -d[1], -d[2]};
    LeftJacobian(minus_d, j);
  }
  /// Computes J_l(d)^-1, |d| < 2 pi.
  template <class T>
  static void LeftJacobianInverse(const T* d, T* j) {
    // c_n of the half angle h: 1 - h cot h = (c_1 - c_0) / c_1 = h^2 (c_2 - c_3) / c_1.
    const StumpffFunctions<T> s(0.25 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
    Polynomial(d, T(-0.5), T((s.c2 - s.c3) / (4.0 * s.c1)), j);
  }
  /// Computes J_r(d)^-1, |d| < 2 pi.
  template <class T>
  static void RightJacobianInverse(const T* d, T* j) {
    const T minus_d[3] = {-d[0], -d[1], -d[2]};
    LeftJacobianInverse(minus_d, j);
  }
};

}  // namespace alidade
