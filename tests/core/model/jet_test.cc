// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/jet.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace alidade {
namespace {

using Jet2 = Jet<double, 2>;

/// Compares f(x, y) with central differences of step h = 1e-5. The differences have an error of h^2
/// f'''/6 and a rounding error of 1e-16/h. Both errors are below 1e-8 for functions and derivatives
/// of order 1 to 100.
template <class F>
void ExpectDerivatives(const F& f, double x, double y) {
  constexpr double kStep = 1e-5, kTolerance = 1e-8;
  const Jet2 jet = f(Jet2(x, 0), Jet2(y, 1));
  EXPECT_DOUBLE_EQ(jet.a, f(x, y));
  EXPECT_NEAR(jet.v[0], (f(x + kStep, y) - f(x - kStep, y)) / (2 * kStep), kTolerance);
  EXPECT_NEAR(jet.v[1], (f(x, y + kStep) - f(x, y - kStep)) / (2 * kStep), kTolerance);
}

TEST(Jet, ArithmeticHasTheDerivativesOfDifferences) {
  for (const double x : {-1.3, 0.7, 2.1}) {
    for (const double y : {-0.6, 1.9}) {
      ExpectDerivatives([](auto a, auto b) { return +a + b - a * b / (-b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return 2.0 + a - (3.0 - b) + (a - 0.5); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return 2.0 * a * 3.0 + 2.0 / b + a / 4.0; }, x, y);
      ExpectDerivatives([](auto a, auto b) { return 2 * a - b / 2 + 1; }, x, y);
      const auto assigned = [](auto a, auto b) {
        auto c = a;
        c += b, c *= a, c -= 3.0 * b, c /= b;
        c += 1.0, c *= 2.0, c -= 0.5, c /= 4.0;
        return c;
      };
      ExpectDerivatives(assigned, x, y);
    }
  }
}

TEST(Jet, PowersHaveTheDerivativesOfDifferences) {
  using std::cbrt, std::hypot, std::pow, std::sqrt;
  for (const double x : {0.4, 1.7}) {
    for (const double y : {-1.2, 0.8}) {
      ExpectDerivatives([](auto a, auto b) { return sqrt(a) + cbrt(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return hypot(a, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return pow(a, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return pow(a, 2.5) + pow(b, 3); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return pow(2.0, a) + b; }, x, y);
      ExpectDerivatives([](auto a, auto b) { return a + pow(b, decltype(b)(2.0)); }, x, y);
    }
  }
}

TEST(Jet, ExponentialsAndLogarithmsHaveTheDerivativesOfDifferences) {
  using std::erf, std::exp, std::exp2, std::expm1, std::log, std::log10, std::log1p, std::log2;
  for (const double x : {-0.8, 1.3}) {
    for (const double y : {0.4, 2.6}) {
      ExpectDerivatives([](auto a, auto b) { return exp(a) + log(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return exp2(a) + log2(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return expm1(a) + log1p(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return a + log10(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return erf(a) + b; }, x, y);
    }
  }
}

TEST(Jet, AnglesHaveTheDerivativesOfDifferences) {
  using std::acos, std::asin, std::atan, std::atan2, std::cos, std::sin, std::tan;
  using std::cosh, std::sinh, std::tanh;
  for (const double x : {-0.9, 0.3}) {
    for (const double y : {-0.5, 0.8}) {
      ExpectDerivatives([](auto a, auto b) { return sin(a) + cos(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return tan(a) + atan(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return asin(a) + acos(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return atan2(a, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return atan2(a, 2.0) + atan2(1.0, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return sinh(a) + cosh(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return tanh(a) * b; }, x, y);
    }
  }
}

TEST(Jet, PiecewiseFunctionsHaveTheDerivativesOfTheirPiece) {
  using std::abs, std::ceil, std::copysign, std::fabs, std::floor, std::fmax, std::fmin, std::fmod,
      std::round;
  for (const double x : {-3.7, 5.2}) {
    for (const double y : {-1.4, 1.4}) {
      ExpectDerivatives([](auto a, auto b) { return abs(a) + fabs(b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return copysign(a, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return fmin(a, b) + 2.0 * fmax(a, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return fmax(a, 0.0) + fmin(1.0, b); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return fmod(a, b) + fmod(b, 1.0); }, x, y);
      ExpectDerivatives([](auto a, auto b) { return floor(a) + ceil(b) + round(a); }, x, y);
    }
  }
}

TEST(Jet, MinimumAndMaximumPassOverNan) {
  const Jet2 x(1.0, 0), nan(std::numeric_limits<double>::quiet_NaN(), 1);
  for (const Jet2& best : {fmin(x, nan), fmin(nan, x), fmax(x, nan), fmax(nan, x)}) {
    EXPECT_EQ(best.a, 1.0);
    EXPECT_EQ(best.v[0], 1.0);
  }
}

TEST(Jet, AConstantExponentServesNegativeNumbersToo) {
  const Jet2 square = pow(Jet2(-3.0, 0), Jet2(2.0));
  EXPECT_EQ(square.a, 9.0);
  EXPECT_EQ(square.v[0], -6.0);
  EXPECT_TRUE(std::isnan(pow(Jet2(-3.0, 0), Jet2(2.0, 1)).v[1]));
  // 0^p is 0 for all p > 0, and x^0 is 1 for all x.
  EXPECT_EQ(pow(Jet2(0.0, 0), Jet2(2.0, 1)).v[1], 0.0);
  EXPECT_EQ(pow(Jet2(0.0, 0), 0.0).v[0], 0.0);
}

TEST(Jet, DecisionsAreThoseOfTheValue) {
  const Jet2 x(1.0, 0), y(2.0, 1);
  EXPECT_TRUE(x < y && x <= y && y > x && y >= x && x != y && x == Jet2(1.0, 1));
  EXPECT_TRUE(x < 2.0 && 0.5 < x && x == 1.0 && x != 2 && 3 > x && x >= 1);
  const double infinity = std::numeric_limits<double>::infinity();
  const Jet2 slope = sqrt(Jet2(0.0, 0));
  EXPECT_EQ(slope.v[0], infinity);
  EXPECT_TRUE(isfinite(slope) && !isinf(slope) && !isnan(slope));
  EXPECT_TRUE(isinf(Jet2(infinity)) && isnan(Jet2(infinity) - infinity));
}

/// Computes a formula with vector operations of Eigen. Works with any number type.
template <class T>
T WithEigen(const T& a, const T& b) {
  const Eigen::Matrix<T, 3, 1> x(a, b, T(2.0)), y = x.cross(Eigen::Matrix<T, 3, 1>(b, a, a));
  const Eigen::Matrix3d constant = Eigen::Vector3d(1.0, 2.0, 3.0).asDiagonal();
  const Eigen::Matrix<T, 3, 1> product = constant * y + 2.0 * x;
  return x.dot(product) + y.norm() + (x * 0.5).squaredNorm();
}

TEST(Jet, MatricesOfEigenMayHaveThem) {
  ExpectDerivatives([](auto a, auto b) { return WithEigen(a, b); }, 0.7, -1.1);
}

TEST(Jet, IsKnownWhenTheProgramIsCompiled) {
  constexpr Jet<float, 1> x(3.0f, 0), y = x * x - 2.0f * x + 1.0f;
  static_assert(y.a == 4.0f && y.v[0] == 4.0f);
}

TEST(Jet, HasTheLimitsOfItsValue) {
  EXPECT_EQ(std::numeric_limits<Jet2>::epsilon(), std::numeric_limits<double>::epsilon());
  EXPECT_EQ(std::numeric_limits<Jet2>::infinity(), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace alidade
