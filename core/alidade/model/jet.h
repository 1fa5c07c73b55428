// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

namespace alidade {

/// Dual number: a value and its derivatives with respect to N variables. The scalar type of a model
/// is a template parameter, so a call with dual numbers also computes the derivatives of the model.
///
///   f(x)     = (f(a), f'(a) v)                          a: value, v: derivatives
///   f(x, y)  = (f(a_x, a_y), df/da_x v_x + df/da_y v_y)
///
/// A constant converts implicitly to a dual number whose derivatives are zero. Comparisons,
/// isfinite, isnan and isinf use only the value. Call functions by argument-dependent lookup, as in
/// `using std::sin; sin(x)`. Dual numbers may be elements of Eigen matrices. The derivatives are
/// infinite or NaN at an argument at which a function has no finite slope, such as 0 for sqrt,
/// hypot and atan2, and 1 for asin.
template <class T, int N>
struct Jet {
  static_assert(std::is_floating_point_v<T> && N > 0, "T must be floating-point, and N > 0");

  T a{};     ///< value
  T v[N]{};  ///< derivatives

  constexpr Jet() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): converts a constant
  constexpr Jet(const T& value) : a(value) {}
  /// Constructs the variable with the index k.
  constexpr Jet(const T& value, int k) : a(value) { v[k] = T(1); }

  constexpr Jet& operator+=(const Jet& y) { return *this = *this + y; }
  constexpr Jet& operator-=(const Jet& y) { return *this = *this - y; }
  constexpr Jet& operator*=(const Jet& y) { return *this = *this * y; }
  constexpr Jet& operator/=(const Jet& y) { return *this = *this / y; }
  constexpr Jet& operator+=(T s) { return *this = *this + s; }
  constexpr Jet& operator-=(T s) { return *this = *this - s; }
  constexpr Jet& operator*=(T s) { return *this = *this * s; }
  constexpr Jet& operator/=(T s) { return *this = *this / s; }

  friend constexpr Jet operator+(const Jet& x) { return x; }
  friend constexpr Jet operator-(const Jet& x) { return Chain(-x.a, T(-1), x); }

  friend constexpr Jet operator+(const Jet& x, const Jet& y) {
    return Chain(x.a + y.a, T(1), x, T(1), y);
  }
  friend constexpr Jet operator-(const Jet& x, const Jet& y) {
    return Chain(x.a - y.a, T(1), x, T(-1), y);
  }
  friend constexpr Jet operator*(const Jet& x, const Jet& y) {
    return Chain(x.a * y.a, y.a, x, x.a, y);
  }
  friend constexpr Jet operator/(const Jet& x, const Jet& y) {
    const T inverse = T(1) / y.a, ratio = x.a * inverse;
    return Chain(ratio, inverse, x, -ratio * inverse, y);
  }
  friend constexpr Jet operator+(const Jet& x, T s) { return Chain(x.a + s, T(1), x); }
  friend constexpr Jet operator-(const Jet& x, T s) { return Chain(x.a - s, T(1), x); }
  friend constexpr Jet operator*(const Jet& x, T s) { return Chain(x.a * s, s, x); }
  friend constexpr Jet operator/(const Jet& x, T s) { return x * (T(1) / s); }
  friend constexpr Jet operator+(T s, const Jet& x) { return x + s; }
  friend constexpr Jet operator-(T s, const Jet& x) { return Chain(s - x.a, T(-1), x); }
  friend constexpr Jet operator*(T s, const Jet& x) { return x * s; }
  friend constexpr Jet operator/(T s, const Jet& x) { return Chain(s / x.a, -s / (x.a * x.a), x); }

  friend constexpr bool operator<(const Jet& x, const Jet& y) { return x.a < y.a; }
  friend constexpr bool operator>(const Jet& x, const Jet& y) { return x.a > y.a; }
  friend constexpr bool operator<=(const Jet& x, const Jet& y) { return x.a <= y.a; }
  friend constexpr bool operator>=(const Jet& x, const Jet& y) { return x.a >= y.a; }
  friend constexpr bool operator==(const Jet& x, const Jet& y) { return x.a == y.a; }
  friend constexpr bool operator!=(const Jet& x, const Jet& y) { return x.a != y.a; }
  friend bool isfinite(const Jet& x) { return std::isfinite(x.a); }
  friend bool isnan(const Jet& x) { return std::isnan(x.a); }
  friend bool isinf(const Jet& x) { return std::isinf(x.a); }

  friend Jet sqrt(const Jet& x) {
    const T f = std::sqrt(x.a);
    return Chain(f, T(1) / (f + f), x);
  }
  friend Jet cbrt(const Jet& x) {
    const T f = std::cbrt(x.a);
    return Chain(f, T(1) / (T(3) * f * f), x);
  }
  friend Jet hypot(const Jet& x, const Jet& y) {
    const T f = std::hypot(x.a, y.a);
    return Chain(f, x.a / f, x, y.a / f, y);
  }
  friend Jet pow(const Jet& x, T p) {
    return Chain(std::pow(x.a, p), p == T(0) ? T(0) : p * std::pow(x.a, p - T(1)), x);
  }
  friend Jet pow(const Jet& x, const Jet& p) {
    if (p.IsConstant()) return pow(x, p.a);  // this overload is also defined for x < 0
    const T f = std::pow(x.a, p.a);
    const T exponent_slope = f == T(0) ? T(0) : f * std::log(x.a);
    return Chain(f, p.a * std::pow(x.a, p.a - T(1)), x, exponent_slope, p);
  }

  friend Jet exp(const Jet& x) {
    const T f = std::exp(x.a);
    return Chain(f, f, x);
  }
  friend Jet exp2(const Jet& x) {
    const T f = std::exp2(x.a);
    return Chain(f, f * T(kLog2), x);
  }
  friend Jet expm1(const Jet& x) { return Chain(std::expm1(x.a), std::exp(x.a), x); }
  friend Jet log(const Jet& x) { return Chain(std::log(x.a), T(1) / x.a, x); }
  friend Jet log2(const Jet& x) { return Chain(std::log2(x.a), T(1) / (x.a * T(kLog2)), x); }
  friend Jet log10(const Jet& x) { return Chain(std::log10(x.a), T(1) / (x.a * T(kLog10)), x); }
  friend Jet log1p(const Jet& x) { return Chain(std::log1p(x.a), T(1) / (T(1) + x.a), x); }
  friend Jet erf(const Jet& x) {
    return Chain(std::erf(x.a), T(kErfSlope) * std::exp(-x.a * x.a), x);
  }

  friend Jet sin(const Jet& x) { return Chain(std::sin(x.a), std::cos(x.a), x); }
  friend Jet cos(const Jet& x) { return Chain(std::cos(x.a), -std::sin(x.a), x); }
  friend Jet tan(const Jet& x) {
    const T f = std::tan(x.a);
    return Chain(f, T(1) + f * f, x);
  }
  friend Jet asin(const Jet& x) {
    return Chain(std::asin(x.a), T(1) / std::sqrt(T(1) - x.a * x.a), x);
  }
  friend Jet acos(const Jet& x) {
    return Chain(std::acos(x.a), T(-1) / std::sqrt(T(1) - x.a * x.a), x);
  }
  friend Jet atan(const Jet& x) { return Chain(std::atan(x.a), T(1) / (T(1) + x.a * x.a), x); }
  friend Jet atan2(const Jet& y, const Jet& x) {
    const T inverse = T(1) / (x.a * x.a + y.a * y.a);
    return Chain(std::atan2(y.a, x.a), x.a * inverse, y, -y.a * inverse, x);
  }
  friend Jet sinh(const Jet& x) { return Chain(std::sinh(x.a), std::cosh(x.a), x); }
  friend Jet cosh(const Jet& x) { return Chain(std::cosh(x.a), std::sinh(x.a), x); }
  friend Jet tanh(const Jet& x) {
    const T f = std::tanh(x.a);
    return Chain(f, T(1) - f * f, x);
  }

  // Piecewise functions. The derivative is the derivative of the piece that contains the value.
  friend Jet abs(const Jet& x) { return std::signbit(x.a) ? -x : x; }
  friend Jet fabs(const Jet& x) { return abs(x); }
  friend Jet copysign(const Jet& x, const Jet& y) {
    return std::signbit(x.a) == std::signbit(y.a) ? x : -x;
  }
  friend Jet fmin(const Jet& x, const Jet& y) { return x.a <= y.a || isnan(y) ? x : y; }
  friend Jet fmax(const Jet& x, const Jet& y) { return x.a >= y.a || isnan(y) ? x : y; }
  friend Jet fmod(const Jet& x, const Jet& y) {
    return Chain(std::fmod(x.a, y.a), T(1), x, -std::trunc(x.a / y.a), y);
  }
  friend Jet floor(const Jet& x) { return std::floor(x.a); }
  friend Jet ceil(const Jet& x) { return std::ceil(x.a); }
  friend Jet round(const Jet& x) { return std::round(x.a); }

 private:
  static constexpr double kLog2 = 0.69314718055994530942, kLog10 = 2.30258509299404568402;
  static constexpr double kErfSlope = 1.12837916709551257390;  ///< 2 / sqrt(pi)

  constexpr bool IsConstant() const {
    for (const T& slope : v) {
      if (slope != T(0)) return false;
    }
    return true;
  }
  /// Applies the chain rule: returns `value` with the derivatives dx v_x, or dx v_x + dy v_y.
  static constexpr Jet Chain(const T& value, const T& dx, const Jet& x) {
    Jet f(value);
    for (int i = 0; i < N; ++i) f.v[i] = dx * x.v[i];
    return f;
  }
  static constexpr Jet Chain(const T& value, const T& dx, const Jet& x, const T& dy, const Jet& y) {
    Jet f(value);
    for (int i = 0; i < N; ++i) f.v[i] = dx * x.v[i] + dy * y.v[i];
    return f;
  }
};

}  // namespace alidade

/// Numeric limits of a dual number, which are the limits of its value type.
template <class T, int N>
class std::numeric_limits<alidade::Jet<T, N>> : public std::numeric_limits<T> {};

// Traits of dual numbers for Eigen, for models that use Eigen matrices.
// NOLINTBEGIN(readability-identifier-naming): the names are Eigen's
namespace Eigen {

template <class T>
struct NumTraits;
template <class A, class B, class Operation>
struct ScalarBinaryOpTraits;

template <class T, int N>
struct NumTraits<alidade::Jet<T, N>> {
  using Real = alidade::Jet<T, N>;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1 + N,
    AddCost = 1 + N,
    MulCost = 3 + 3 * N
  };
  static constexpr Real epsilon() { return std::numeric_limits<T>::epsilon(); }
  static constexpr Real dummy_precision() { return T(1e-12); }
  static constexpr Real highest() { return std::numeric_limits<T>::max(); }
  static constexpr Real lowest() { return std::numeric_limits<T>::lowest(); }
  static constexpr int digits10() { return std::numeric_limits<T>::digits10; }
};

/// Allows products of a matrix of dual numbers and a matrix of numbers.
template <class T, int N, class Operation>
struct ScalarBinaryOpTraits<alidade::Jet<T, N>, T, Operation> {
  using ReturnType = alidade::Jet<T, N>;
};
template <class T, int N, class Operation>
struct ScalarBinaryOpTraits<T, alidade::Jet<T, N>, Operation> {
  using ReturnType = alidade::Jet<T, N>;
};

}  // namespace Eigen
// NOLINTEND(readability-identifier-naming)
