// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

namespace alidade {
namespace detail {

/// The value of a number that may be dual.
template <class T>
double ValueOf(const T& x) {
  if constexpr (std::is_arithmetic_v<T>) {
    return x;
  } else {
    return x.a;
  }
}

/// r -> r s(r^2),  s(q) = 1 + k1 q + k2 q^2 + k3 q^3 + k4 q^4, on 0 <= r^2 <= q_max, where it
/// grows. In squares, so that it is smooth at r = 0.
struct RadialPolynomial {
  std::array<double, 4> k{};
  double q_max = 0.0;

  RadialPolynomial() = default;
  /// q_max is `most`, or to 1 % where r s(r^2) begins to turn back.
  RadialPolynomial(const std::array<double, 4>& coefficients, double most) : k(coefficients) {
    for (double q = 1e-6; q < most && Slope(q) > 0.0; q *= 1.01) q_max = q;
    if (q_max > 0.98 * most) q_max = most;
  }
  /// s(q)
  template <class T>
  T Factor(const T& q) const {
    return 1.0 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3])));
  }
  /// ds/dq
  double FactorSlope(double q) const {
    return k[0] + q * (2.0 * k[1] + q * (3.0 * k[2] + q * 4.0 * k[3]));
  }
  /// d (r s(r^2)) / dr at r^2 = q
  double Slope(double q) const { return Factor(q) + 2.0 * q * FactorSlope(q); }

  /// The q with q s(q)^2 = square; false where there is none in [0, q_max].
  template <class T>
  bool Invert(const T& square, T* q) const {
    const double wanted = ValueOf(square);
    const auto excess = [&](double at) { return at * Factor(at) * Factor(at) - wanted; };
    if (!(wanted >= 0.0) || !(excess(q_max) >= 0.0)) return false;
    double low = 0.0, high = q_max, at = wanted < high ? wanted : high;
    constexpr int kMost = 100;  // Newton takes about 5; halving the bracket, 60
    for (int i = 0; i < kMost; ++i) {
      const double f = excess(at);
      (f > 0.0 ? high : low) = at;
      double next = at - f / (Factor(at) * Slope(at));
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      const double step = std::abs(next - at);
      at = next;
      if (!(step > 1e-16 * at)) break;
    }
    // One more step of Newton, which is exact in the derivatives by the implicit function theorem.
    *q = at - (at * Factor(at) * Factor(at) - square) / (Factor(at) * Slope(at));
    return true;
  }
};

}  // namespace detail

}  // namespace alidade
