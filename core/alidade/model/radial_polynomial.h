// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

namespace alidade {
namespace detail {

/// Returns the value of a number or of a dual number.
template <class T>
double ValueOf(const T& x) {
  if constexpr (std::is_arithmetic_v<T>) {
    return x;
  } else {
    return x.a;
  }
}

/// Radial polynomial r s(r^2) with s(q) = 1 + k1 q + k2 q^2 + k3 q^3 + k4 q^4, or the quotient of
/// this s(q) and 1 + d1 q + d2 q^2 + d3 q^3. The function increases on its domain
/// 0 <= r^2 <= q_max. The argument of the functions is q = r^2, because they are then smooth at
/// r = 0.
struct RadialPolynomial {
  std::array<double, 4> k{};
  std::array<double, 3> d{};  ///< coefficients of the denominator
  bool has_denominator = false;
  double q_max = 0.0;

  RadialPolynomial() = default;
  /// Sets q_max to `limit`, or to the first maximum or pole of r s(r^2) if this point is below
  /// `limit`. The relative error of the point is at most 1 %.
  RadialPolynomial(const std::array<double, 4>& coefficients, double limit,
                   const std::array<double, 3>& denominator = {})
      : k(coefficients), d(denominator), has_denominator(denominator != std::array<double, 3>{}) {
    for (double q = 1e-6; q < limit && Factor(q) > 0.0 && Slope(q) > 0.0; q *= 1.01) q_max = q;
    if (q_max > 0.98 * limit) q_max = limit;
  }
  /// Returns s(q).
  template <class T>
  T Factor(const T& q) const {
    const T numerator = 1.0 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3])));
    return has_denominator ? T(numerator / Denominator(q)) : numerator;
  }
  /// Returns ds/dq.
  double FactorSlope(double q) const {
    const double slope = k[0] + q * (2.0 * k[1] + q * (3.0 * k[2] + q * 4.0 * k[3]));
    if (!has_denominator) return slope;
    const double denominator_slope = d[0] + q * (2.0 * d[1] + q * 3.0 * d[2]);
    return (slope - Factor(q) * denominator_slope) / Denominator(q);
  }
  /// Returns d (r s(r^2)) / dr at r^2 = q.
  double Slope(double q) const { return Factor(q) + 2.0 * q * FactorSlope(q); }

  /// Solves q s(q)^2 = square for q. Returns false if [0, q_max] contains no solution.
  template <class T>
  bool Invert(const T& square, T* q) const {
    const double target = ValueOf(square);
    const auto excess = [&](double x) { return x * Factor(x) * Factor(x) - target; };
    if (!(target >= 0.0) || !(excess(q_max) >= 0.0)) return false;
    double low = 0.0, high = q_max, x = target < high ? target : high;
    constexpr int kMaxIterations = 100;  // Newton's method needs about 5, bisection about 60
    for (int i = 0; i < kMaxIterations; ++i) {
      const double f = excess(x);
      (f > 0.0 ? high : low) = x;
      double next = x - f / (Factor(x) * Slope(x));
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      const double step = std::abs(next - x);
      x = next;
      if (!(step > 1e-16 * x)) break;
    }
    // One more Newton step with `square` as a dual number computes the exact derivatives of *q
    // (implicit function theorem).
    *q = x - (x * Factor(x) * Factor(x) - square) / (Factor(x) * Slope(x));
    return true;
  }

 private:
  template <class T>
  T Denominator(const T& q) const {
    return 1.0 + q * (d[0] + q * (d[1] + q * d[2]));
  }
};

}  // namespace detail

}  // namespace alidade
