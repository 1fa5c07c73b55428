// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "alidade/model/plugin_abi.h"
#include "alidade/model/rotation.h"

/// Geometries of state blocks, measurements and inputs. A geometry defines the sum of a value and a
/// small vector, y = x (+) d, and the difference of two values, d = y (-) x. Every geometry
/// satisfies
///
///   (1)  x (+) 0 = x
///   (2)  (x (+) d) (-) x = d          for small d
///   (3)  x (+) (y (-) x) = y
///
/// The scalar types of x and d are template parameters: double or a dual number.
///
/// alidade/model/euclidean_group.h contains the Euclidean groups. A geometry of fixed size has an
/// entry in alidade/state/geometry_table.h, and is a struct with
///
///   kGeometry                constant of the geometry in plugin_abi.h, such as ALIDADE_ANGLE
///   kAmbient, kTangent       number of elements of a value and of d
///   kIdentity                the neutral element
///   Plus, Minus              the operations (+) and (-)
///   Normalise(x)             removes the rounding errors that move x off the manifold
///   Distance(x)              optional: distance of x from the manifold; default: 0
///   Transport(x, y, j)       optional: j (kTangent x kTangent, row-major) transports a tangent
///                            vector at x to the tangent space of y; default: the identity
///   PlusJacobian(x, d, j)    optional: j = d(x (+) d)/dd, in the tangent space at x (+) d;
///                            default: automatic differentiation of Plus and Minus
///   PlusJacobianX(x, d, j)   optional: j = d(x (+) d)/dx, likewise
namespace alidade {

/// Size of a block if the size is known only at run time.
inline constexpr int kDynamic = -1;

/// R^N: y = x + d.
template <int N>
struct Vec {
  static constexpr std::uint32_t kGeometry = ALIDADE_VECTOR;
  static constexpr int kAmbient = N, kTangent = N;
  static void Normalise(double*) {}
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int size = N) {
    for (int i = 0; i < size; ++i) y[i] = x[i] + d[i];
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int size = N) {
    for (int i = 0; i < size; ++i) d[i] = y[i] - x[i];
  }
};

/// SO(2), stored as one number in (-pi, pi]: y = wrap(x + d).
struct Angle {
  static constexpr std::uint32_t kGeometry = ALIDADE_ANGLE;
  static constexpr int kAmbient = 1, kTangent = 1;
  static constexpr std::array<double, 1> kIdentity{0.0};

  /// Returns a - 2 pi k with the integer k for which the result is in (-pi, pi].
  template <class T>
  static T Wrap(const T& a) {
    constexpr double kPi = 3.14159265358979323846;
    using std::ceil;
    const T wrapped = a - 2.0 * kPi * ceil((a - kPi) / (2.0 * kPi));
    // Rounding may move the result out of the interval by one ulp.
    if (wrapped > T(kPi)) return wrapped - 2.0 * kPi;
    if (wrapped <= T(-kPi)) return wrapped + 2.0 * kPi;
    return wrapped;
  }
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int = 1) {
    y[0] = Wrap(Y(x[0] + d[0]));
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int = 1) {
    d[0] = Wrap(D(y[0] - x[0]));
  }
  static void Normalise(double* x) { x[0] = Wrap(x[0]); }
};

namespace detail {

/// Base of a geometry G whose values are vectors of unit length.
template <class G, int N>
struct UnitLength {
  /// Replaces x by x / |x|, or by the neutral element if x = 0. Does not change x if |x| is not
  /// finite, or differs from 1 only by rounding.
  static void Normalise(double* x) {
    constexpr double kRounding = 4e-16;
    const double norm = Norm(x);
    if (!std::isfinite(norm) || std::abs(norm - 1.0) <= kRounding) return;
    for (int i = 0; i < N; ++i) x[i] = norm == 0.0 ? G::kIdentity[i] : x[i] * (1.0 / norm);
  }
  /// Returns | |x| - 1 |.
  static double Distance(const double* x) { return std::abs(Norm(x) - 1.0); }

 private:
  static double Norm(const double* x) {
    double sum = 0.0;
    for (int i = 0; i < N; ++i) sum += x[i] * x[i];
    return std::sqrt(sum);
  }
};

}  // namespace detail

/// S^3: unit quaternions of Hamilton's convention, stored as w x y z. q (+) d = q Exp(d), with
/// Exp(d) = (cos |d|/2, sin(|d|/2) d/|d|). q and -q are the same rotation; (-) returns the shorter
/// of the two differences, with |d| <= pi. Source: [Sola2017] ch. 4.
struct UnitQuaternion : detail::UnitLength<UnitQuaternion, 4> {
  static constexpr std::uint32_t kGeometry = ALIDADE_UNIT_QUATERNION;
  static constexpr int kAmbient = 4, kTangent = 3;
  static constexpr std::array<double, 4> kIdentity{1.0, 0.0, 0.0, 0.0};

  /// Computes c = a b.
  template <class A, class B, class C>
  static void Multiply(const A* a, const B* b, C* c) {
    c[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    c[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    c[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    c[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
  }
  /// Computes q = Exp(d), d in rad. The result is accurate to rounding errors, also near d = 0.
  template <class T>
  static void Exp(const T* d, T* q) {
    using std::cos;
    using std::sin;
    using std::sqrt;
    const T angle2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    T s;  // sin(|d|/2) / |d|
    if (angle2 > T(1e-12)) {
      const T angle = sqrt(angle2);
      s = sin(0.5 * angle) / angle;
      q[0] = cos(0.5 * angle);
    } else {
      s = T(0.5) - angle2 / 48.0;
      q[0] = T(1.0) - angle2 / 8.0;
    }
    for (int i = 0; i < 3; ++i) q[i + 1] = s * d[i];
  }
  /// Computes d = Log(q) with |d| <= pi.
  template <class T>
  static void Log(const T* q, T* d) {
    using std::atan2;
    using std::sqrt;
    const double sign = q[0] < T(0.0) ? -1.0 : 1.0;
    const T s2 = q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    T k;  // |d| / sin(|d|/2)
    if (s2 > T(1e-12)) {
      const T s = sqrt(s2);
      k = 2.0 * sign * atan2(s, sign * q[0]) / s;
    } else {
      k = 2.0 / q[0] - 2.0 * s2 / (3.0 * q[0] * q[0] * q[0]);
    }
    for (int i = 0; i < 3; ++i) d[i] = k * q[i + 1];
  }
  /// Computes y = R(q) x.
  template <class Q, class X, class Y>
  static void Rotate(const Q* q, const X* x, Y* y) {
    // y = x + q0 t + cross(qv, t) with t = 2 cross(qv, x)
    const Y t[3] = {2.0 * (q[2] * x[2] - q[3] * x[1]), 2.0 * (q[3] * x[0] - q[1] * x[2]),
                    2.0 * (q[1] * x[1] - q[2] * x[0])};
    y[0] = x[0] + q[0] * t[0] + q[2] * t[2] - q[3] * t[1];
    y[1] = x[1] + q[0] * t[1] + q[3] * t[0] - q[1] * t[2];
    y[2] = x[2] + q[0] * t[2] + q[1] * t[1] - q[2] * t[0];
  }
  /// Computes y = R(q)' x.
  template <class Q, class X, class Y>
  static void RotateBack(const Q* q, const X* x, Y* y) {
    const Q conjugate[4] = {q[0], -q[1], -q[2], -q[3]};
    Rotate(conjugate, x, y);
  }
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int = 4) {
    D dq[4];
    Exp(d, dq);
    Multiply(x, dq, y);
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int = 4) {
    const X conjugate[4] = {x[0], -x[1], -x[2], -x[3]};
    D q[4];
    Multiply(conjugate, y, q);
    Log(q, d);
  }
  /// Computes the right Jacobian of SO(3).
  static void PlusJacobian(const double*, const double* d, double* j) {
    Rotation::RightJacobian(d, j);
  }
};

/// S^2: y = cos|d| x + sin|d|/|d| B(x) d. B(x) (3x2) is an orthonormal basis of the plane normal to
/// x [Duff2017]. If y is the antipode of x, all geodesics are equally long, and y (-) x returns
/// (pi, 0).
struct UnitVector : detail::UnitLength<UnitVector, 3> {
  static constexpr std::uint32_t kGeometry = ALIDADE_UNIT_VECTOR;
  static constexpr int kAmbient = 3, kTangent = 2;
  static constexpr std::array<double, 3> kIdentity{0.0, 0.0, 1.0};

  /// Computes b = B(x), row-major 3x2.
  template <class T>
  static void Basis(const T* x, T* b) {
    const double sign = x[2] < T(0.0) ? -1.0 : 1.0;
    const T a = -1.0 / (sign + x[2]);
    const T c = x[0] * x[1] * a;
    b[0] = 1.0 + sign * x[0] * x[0] * a;
    b[1] = c;
    b[2] = sign * c;
    b[3] = sign + x[1] * x[1] * a;
    b[4] = -sign * x[0];
    b[5] = -x[1];
  }
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int = 3) {
    using std::cos;
    using std::sin;
    using std::sqrt;
    X b[6];
    Basis(x, b);
    const D angle2 = d[0] * d[0] + d[1] * d[1];
    D s, c;
    if (angle2 > D(1e-12)) {
      const D angle = sqrt(angle2);
      s = sin(angle) / angle;
      c = cos(angle);
    } else {
      s = 1.0 - angle2 / 6.0;
      c = 1.0 - angle2 / 2.0;
    }
    for (int i = 0; i < 3; ++i) y[i] = c * x[i] + s * (b[2 * i] * d[0] + b[2 * i + 1] * d[1]);
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int = 3) {
    using std::atan2;
    using std::sqrt;
    X b[6];
    Basis(x, b);
    const D c = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    D p[2];
    for (int j = 0; j < 2; ++j) p[j] = b[j] * y[0] + b[2 + j] * y[1] + b[4 + j] * y[2];
    const D s2 = p[0] * p[0] + p[1] * p[1];
    D k;  // angle / sin(angle)
    if (c > D(0.0) && !(s2 > D(1e-12))) {
      k = 1.0 + s2 / 6.0;
    } else if (s2 > D(1e-300)) {  // sqrt(s2) is inaccurate below this limit
      const D s = sqrt(s2);
      k = atan2(s, c) / s;
    } else {
      d[0] = D(3.14159265358979323846);
      d[1] = D(0.0);
      return;
    }
    d[0] = k * p[0];
    d[1] = k * p[1];
  }
  /// Computes the parallel transport j = B(y)' R B(x) (2x2, row-major). R is the smallest rotation
  /// of x to y, R v = v - (x + y) (y . v) / (1 + x . y). If y is the antipode of x, the transport
  /// follows the geodesic in the direction of the first basis vector.
  static void Transport(const double* x, const double* y, double* j) {
    double b_x[6], b_y[6];
    Basis(x, b_x);
    Basis(y, b_y);
    const double c = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    constexpr double kAntipode = 1e-14;
    for (int column = 0; column < 2; ++column) {
      double v[3];
      for (int i = 0; i < 3; ++i) v[i] = b_x[2 * i + column];
      if (1.0 + c > kAntipode) {
        const double k = (y[0] * v[0] + y[1] * v[1] + y[2] * v[2]) / (1.0 + c);
        for (int i = 0; i < 3; ++i) v[i] -= k * (x[i] + y[i]);
      } else if (column == 0) {
        for (int i = 0; i < 3; ++i) v[i] = -v[i];
      }
      for (int row = 0; row < 2; ++row) {
        j[2 * row + column] = b_y[row] * v[0] + b_y[2 + row] * v[1] + b_y[4 + row] * v[2];
      }
    }
  }
  /// Computes the derivative of the exponential map of S^2 in the tangent space at x (+) d. The
  /// derivative preserves lengths along d, and multiplies lengths across d by sin |d| / |d|.
  static void PlusJacobian(const double* x, const double* d, double* j) {
    const double t2 = d[0] * d[0] + d[1] * d[1], t = std::sqrt(t2);
    constexpr double kSeries = 1e-4;
    const double s = t < kSeries ? 1.0 - t2 / 6.0 : std::sin(t) / t;
    const double k = t < kSeries ? 1.0 / 6.0 : (1.0 - s) / t2;  // coefficient of d d'
    double y[3], transport[4];
    Plus(x, d, y);
    Normalise(y);
    Transport(x, y, transport);
    for (int row = 0; row < 2; ++row) {
      const double along = transport[2 * row] * d[0] + transport[2 * row + 1] * d[1];
      for (int column = 0; column < 2; ++column) {
        j[2 * row + column] = s * transport[2 * row + column] + k * along * d[column];
      }
    }
  }
};

/// Composite value, each part of which has its own geometry. Measurements whose parts have
/// correlated noise use this geometry, such as a pose, or a range with a bearing.
template <class... Parts>
struct Product {
  static_assert(sizeof...(Parts) > 0 && ((Parts::kTangent > 0) && ... && true) &&
                    ((Parts::kGeometry != ALIDADE_PRODUCT) && ... && true),
                "a part must have a fixed size and must not be a product");
  static constexpr std::uint32_t kGeometry = ALIDADE_PRODUCT;
  static constexpr int kAmbient = (Parts::kAmbient + ...), kTangent = (Parts::kTangent + ...);
  static constexpr std::size_t kParts = sizeof...(Parts);

  /// Calls f(Part{}, ambient offset, tangent offset) for each part.
  template <class F>
  static void ForEachPart(const F& f) {
    int ambient = 0, tangent = 0;
    ((f(Parts{}, ambient, tangent), ambient += Parts::kAmbient, tangent += Parts::kTangent), ...);
  }
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int = 0) {
    ForEachPart([&](auto part, int a, int t) { decltype(part)::Plus(x + a, d + t, y + a); });
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int = 0) {
    ForEachPart([&](auto part, int a, int t) { decltype(part)::Minus(y + a, x + a, d + t); });
  }
};

namespace detail {

template <class G, class = void>
struct HasTransport : std::false_type {};
template <class G>
struct HasTransport<G, std::void_t<decltype(G::Transport(
                           static_cast<const double*>(nullptr), static_cast<const double*>(nullptr),
                           static_cast<double*>(nullptr)))>> : std::true_type {};

}  // namespace detail

/// True if the tangent basis of G depends on the point. A covariance must then be rotated when the
/// point moves.
template <class G>
inline constexpr bool kHasTransport = detail::HasTransport<G>::value;

}  // namespace alidade
