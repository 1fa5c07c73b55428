// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "alidade/model/geometry.h"
#include "alidade/model/rotation.h"

/// Euclidean groups: poses, and poses with a velocity, as one element X of a matrix Lie group. Each
/// group is a struct with static functions on row-major arrays, templates on the scalar type. xi is
/// a tangent vector: the position precedes the rotation, the rotation precedes the velocity.
///
///   Exp, Log                   xi <-> X, closed form
///   Multiply, Inverse          c = a b,   y = x^-1
///   Between(x, y, z)           z = x^-1 y
///   Adjoint(x, m)              X Exp(xi) X^-1 = Exp(Ad_X xi)
///   LeftJacobian(xi, j)        Exp(xi + e) = Exp(J_l e) Exp(xi)      for small e
///   RightJacobian(xi, j)       Exp(xi + e) = Exp(xi) Exp(J_r e),  J_r(xi) = J_l(-xi)
///   Rotations(x, m)            m = blkdiag(R, ...): Ad_X for a position and velocity of zero
///
/// LeftInvariant and RightInvariant make geometries of blocks from a group. SO(2) is the geometry
/// Angle, SO(3) is UnitQuaternion. Sources: [Sola2018], [Barfoot2017] ch. 7, [Barrau2017].
namespace alidade {

/// SE(2): a pose in the plane, (x, y, theta), theta in rad. xi = (rho, theta).
///
///   Exp(xi) = (V rho, theta),   V = [c_1 -theta c_2; theta c_2 c_1],   c_n = c_n(theta^2)
struct Se2 {
  static constexpr std::uint32_t kLeftNumber = ALIDADE_SE_2_LEFT, kRightNumber = ALIDADE_SE_2_RIGHT;
  static constexpr int kAmbient = 3, kTangent = 3;
  static constexpr std::array<double, 3> kIdentity{0.0, 0.0, 0.0};

  /// Computes c = a b.
  template <class A, class B, class C>
  static void Multiply(const A* a, const B* b, C* c) {
    C rotated[2];
    Rotate(a[2], b, rotated);
    for (int i = 0; i < 2; ++i) c[i] = a[i] + rotated[i];
    Angle::Plus(a + 2, b + 2, c + 2);
  }
  /// Computes y = x^-1.
  template <class X, class Y>
  static void Inverse(const X* x, Y* y) {
    const Y back[2] = {-x[0], -x[1]};
    Rotate(Y(-x[2]), back, y);
    y[2] = -x[2];
  }
  /// Computes z = x^-1 y.
  template <class X, class Y, class Z>
  static void Between(const X* x, const Y* y, Z* z) {
    const Z difference[2] = {y[0] - x[0], y[1] - x[1]};
    Rotate(X(-x[2]), difference, z);
    Angle::Minus(y + 2, x + 2, z + 2);
  }
  /// Computes x = Exp(xi).
  template <class T>
  static void Exp(const T* xi, T* x) {
    const StumpffFunctions<T> s(xi[2] * xi[2]);
    const T sine = xi[2] * s.c2;
    x[0] = s.c1 * xi[0] - sine * xi[1];
    x[1] = sine * xi[0] + s.c1 * xi[1];
    x[2] = Angle::Wrap(xi[2]);
  }
  /// Computes xi = Log(x). x[2] must be in (-pi, pi].
  template <class T>
  static void Log(const T* x, T* xi) {
    // det V = c_1^2 + theta^2 c_2^2 = 2 c_2
    const StumpffFunctions<T> s(x[2] * x[2]);
    const T cosine = s.c1 / (2.0 * s.c2), sine = 0.5 * x[2];
    const T x0 = x[0], x1 = x[1];
    xi[0] = cosine * x0 + sine * x1;
    xi[1] = cosine * x1 - sine * x0;
    xi[2] = x[2];
  }
  /// Computes m = Ad_x, 3x3.
  template <class T>
  static void Adjoint(const T* x, T* m) {
    using std::cos;
    using std::sin;
    const T c = cos(x[2]), s = sin(x[2]);
    const T rows[9] = {c, -s, x[1], s, c, -x[0], T(0.0), T(0.0), T(1.0)};
    for (int i = 0; i < 9; ++i) m[i] = rows[i];
  }
  /// Computes J_l(xi), the integral of Ad_Exp(s xi) over s from 0 to 1. [Sola2018] eq. 164.
  template <class T>
  static void LeftJacobian(const T* xi, T* j) {
    const StumpffFunctions<T> s(xi[2] * xi[2]);
    const T sine = xi[2] * s.c2, mean = xi[2] * s.c3;
    const T rows[9] = {s.c1,   -sine,  mean * xi[0] + s.c2 * xi[1],
                       sine,   s.c1,   mean * xi[1] - s.c2 * xi[0],
                       T(0.0), T(0.0), T(1.0)};
    for (int i = 0; i < 9; ++i) j[i] = rows[i];
  }
  /// Computes J_r(xi) = J_l(-xi).
  template <class T>
  static void RightJacobian(const T* xi, T* j) {
    const T minus_xi[3] = {-xi[0], -xi[1], -xi[2]};
    LeftJacobian(minus_xi, j);
  }
  /// Computes m = blkdiag(R(theta), 1).
  static void Rotations(const double* x, double* m) {
    const double origin[3] = {0.0, 0.0, x[2]};
    Adjoint(origin, m);
  }
  static void Normalise(double* x) { Angle::Normalise(x + 2); }

 private:
  template <class A, class X, class Y>
  static void Rotate(const A& angle, const X* x, Y* y) {
    using std::cos;
    using std::sin;
    const A c = cos(angle), s = sin(angle);
    const Y y0 = c * x[0] - s * x[1];
    y[1] = s * x[0] + c * x[1];
    y[0] = y0;
  }
};

namespace detail {

/// SE(3) and SE_2(3): kVectors = 1: (p, q), kVectors = 2: (p, q, v). q is a unit quaternion.
///
///   Exp(rho, phi, nu) = (J_l(phi) rho, Exp(phi), J_l(phi) nu)
///   J_l(xi)           = [J Q(rho) 0; 0 J 0; 0 Q(nu) J],   J = J_l(phi)      [Barfoot2017] ch. 7
template <int kVectors>
struct SpatialGroup {
  static_assert(kVectors == 1 || kVectors == 2, "SE(3) or SE_2(3)");
  static constexpr std::uint32_t kLeftNumber =
      kVectors == 1 ? ALIDADE_SE_3_LEFT : ALIDADE_SE_2_3_LEFT;
  static constexpr std::uint32_t kRightNumber =
      kVectors == 1 ? ALIDADE_SE_3_RIGHT : ALIDADE_SE_2_3_RIGHT;
  static constexpr int kAmbient = 4 + 3 * kVectors, kTangent = 3 + 3 * kVectors;
  static constexpr std::array<double, kAmbient> kIdentity{0.0, 0.0, 0.0, 1.0};

  template <class A, class B, class C>
  static void Multiply(const A* a, const B* b, C* c) {
    for (const int v : kVectorOffsets) {
      UnitQuaternion::Rotate(a + kQuaternion, b + v, c + v);
      for (int i = v; i < v + 3; ++i) c[i] = a[i] + c[i];
    }
    UnitQuaternion::Multiply(a + kQuaternion, b + kQuaternion, c + kQuaternion);
  }
  template <class X, class Y>
  static void Inverse(const X* x, Y* y) {
    for (const int v : kVectorOffsets) {
      UnitQuaternion::RotateBack(x + kQuaternion, x + v, y + v);
      for (int i = v; i < v + 3; ++i) y[i] = -y[i];
    }
    Conjugate(x + kQuaternion, y + kQuaternion);
  }
  template <class X, class Y, class Z>
  static void Between(const X* x, const Y* y, Z* z) {
    for (const int v : kVectorOffsets) {
      const Z difference[3] = {y[v] - x[v], y[v + 1] - x[v + 1], y[v + 2] - x[v + 2]};
      UnitQuaternion::RotateBack(x + kQuaternion, difference, z + v);
    }
    X conjugate[4];
    Conjugate(x + kQuaternion, conjugate);
    UnitQuaternion::Multiply(conjugate, y + kQuaternion, z + kQuaternion);
  }
  template <class T>
  static void Exp(const T* xi, T* x) {
    T j[9];
    Rotation::LeftJacobian(xi + 3, j);
    for (int k = 0; k < kVectors; ++k) Transform(j, xi + 6 * k, x + kVectorOffsets[k]);
    UnitQuaternion::Exp(xi + 3, x + kQuaternion);
  }
  template <class T>
  static void Log(const T* x, T* xi) {
    T j[9];
    UnitQuaternion::Log(x + kQuaternion, xi + 3);
    Rotation::LeftJacobianInverse(xi + 3, j);
    for (int k = 0; k < kVectors; ++k) Transform(j, x + kVectorOffsets[k], xi + 6 * k);
  }
  template <class T>
  static void Adjoint(const T* x, T* m) {
    Rotations(x, m);
    for (int k = 0; k < kVectors; ++k) {
      for (int column = 3; column < 6; ++column) {
        const T* const a = x + kVectorOffsets[k];
        const T r[3] = {m[3 * kTangent + column], m[4 * kTangent + column],
                        m[5 * kTangent + column]};
        for (int i = 0; i < 3; ++i) {
          const int j = (i + 1) % 3, l = (i + 2) % 3;
          m[(6 * k + i) * kTangent + column] = a[j] * r[l] - a[l] * r[j];
        }
      }
    }
  }
  template <class T>
  static void LeftJacobian(const T* xi, T* m) {
    T j[9];
    Rotation::LeftJacobian(xi + 3, j);
    Diagonal(m, [&](int, int row, int column) { return j[3 * row + column]; });
    for (int k = 0; k < kVectors; ++k) {
      Coupling(xi + 6 * k, xi + 3, j);
      for (int i = 0; i < 9; ++i) m[(6 * k + i / 3) * kTangent + 3 + i % 3] = j[i];
    }
  }
  template <class T>
  static void RightJacobian(const T* xi, T* m) {
    T minus_xi[kTangent];
    for (int i = 0; i < kTangent; ++i) minus_xi[i] = -xi[i];
    LeftJacobian(minus_xi, m);
  }
  /// Computes m = blkdiag(R, R) for SE(3), and blkdiag(R, R, R) for SE_2(3).
  template <class T>
  static void Rotations(const T* x, T* m) {
    T r[9];
    for (int column = 0; column < 3; ++column) {
      const T axis[3] = {T(column == 0), T(column == 1), T(column == 2)};
      T image[3];
      UnitQuaternion::Rotate(x + kQuaternion, axis, image);
      for (int row = 0; row < 3; ++row) r[3 * row + column] = image[row];
    }
    Diagonal(m, [&](int, int row, int column) { return r[3 * row + column]; });
  }
  static void Normalise(double* x) { UnitQuaternion::Normalise(x + kQuaternion); }
  static double Distance(const double* x) { return UnitQuaternion::Distance(x + kQuaternion); }

 private:
  static constexpr int kQuaternion = 3;  ///< offset of q
  static constexpr std::array<int, kVectors> kVectorOffsets = [] {
    std::array<int, kVectors> offsets{};
    for (int k = 0; k < kVectors; ++k) offsets[k] = 7 * k;
    return offsets;
  }();

  template <class X, class Y>
  static void Conjugate(const X* q, Y* conjugate) {
    conjugate[0] = q[0];
    for (int i = 1; i < 4; ++i) conjugate[i] = -q[i];
  }
  /// Computes y = m x, m 3x3.
  template <class T>
  static void Transform(const T* m, const T* x, T* y) {
    for (int i = 0; i < 3; ++i) {
      y[i] = m[3 * i] * x[0] + m[3 * i + 1] * x[1] + m[3 * i + 2] * x[2];
    }
  }
  /// Computes c = a b, 3x3. The memory of c overlaps neither a nor b.
  template <class T>
  static void Product(const T* a, const T* b, T* c) {
    for (int i = 0; i < 9; ++i) {
      c[i] = a[i - i % 3] * b[i % 3] + a[i - i % 3 + 1] * b[3 + i % 3] +
             a[i - i % 3 + 2] * b[6 + i % 3];
    }
  }
  /// Sets m to a block-diagonal matrix: element (row, column) of the 3x3 block b is
  /// element(b, row, column).
  template <class T, class Element>
  static void Diagonal(T* m, const Element& element) {
    for (int row = 0; row < kTangent; ++row) {
      for (int column = 0; column < kTangent; ++column) {
        m[row * kTangent + column] =
            row / 3 == column / 3 ? element(row / 3, row % 3, column % 3) : T(0.0);
      }
    }
  }
  /// Computes Q(a), the upper right block of J_l of SE(3), with A = [a]x and W = [phi]x:
  ///
  ///   Q = A/2 + c_3 (W A + A W + W A W) + c_4 (W W A + A W W - 3 W A W)
  ///       + (c_4 - 3 c_5)/2 (W A W W + W W A W)                         [Barfoot2017] ch. 7
  template <class T>
  static void Coupling(const T* a, const T* phi, T* q) {
    const StumpffFunctions<T> s(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2]);
    const T k5 = 0.5 * (s.c4 - 3.0 * s.c5);
    const T am[9] = {T(0.0), -a[2], a[1], a[2], T(0.0), -a[0], -a[1], a[0], T(0.0)};
    const T w[9] = {T(0.0), -phi[2], phi[1], phi[2], T(0.0), -phi[0], -phi[1], phi[0], T(0.0)};
    T wa[9], aw[9], waw[9], wwa[9], aww[9], waww[9], wwaw[9];
    Product(w, am, wa);
    Product(am, w, aw);
    Product(wa, w, waw);
    Product(w, wa, wwa);
    Product(aw, w, aww);
    Product(waw, w, waww);
    Product(w, waw, wwaw);
    for (int i = 0; i < 9; ++i) {
      q[i] = 0.5 * am[i] + s.c3 * (wa[i] + aw[i] + waw[i]) +
             s.c4 * (wwa[i] + aww[i] - 3.0 * waw[i]) + k5 * (waww[i] + wwaw[i]);
    }
  }
};

}  // namespace detail

/// SE(3): a pose (p, q). SE_2(3): a pose with a velocity, (p, q, v) [Barrau2017].
using Se3 = detail::SpatialGroup<1>;
using Se23 = detail::SpatialGroup<2>;

/// Geometry of a group element with the left-invariant error: x (+) d = x Exp(d). d is in the frame
/// of the body. The name of the error is that of [Barrau2017]: x^-1 y is the same for Z x and Z y.
template <class Group>
struct LeftInvariant : Group {
  static constexpr std::uint32_t kGeometry = Group::kLeftNumber;
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int = 0) {
    D step[Group::kAmbient];
    Group::Exp(d, step);
    Group::Multiply(x, step, y);
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int = 0) {
    D step[Group::kAmbient];
    Group::Between(x, y, step);
    Group::Log(step, d);
  }
  static void PlusJacobian(const double*, const double* d, double* j) {
    Group::RightJacobian(d, j);
  }
  static void PlusJacobianX(const double*, const double* d, double* j) {
    double step[Group::kAmbient], back[Group::kAmbient];
    Group::Exp(d, step);
    Group::Inverse(step, back);
    Group::Adjoint(back, j);
  }
};

/// Geometry of a group element with the right-invariant error: x (+) d = Exp(d) x. d is in the
/// frame of the world. y x^-1 is the same for x Z and y Z.
template <class Group>
struct RightInvariant : Group {
  static constexpr std::uint32_t kGeometry = Group::kRightNumber;
  template <class X, class D, class Y>
  static void Plus(const X* x, const D* d, Y* y, int = 0) {
    D step[Group::kAmbient];
    Group::Exp(d, step);
    Group::Multiply(step, x, y);
  }
  template <class Y, class X, class D>
  static void Minus(const Y* y, const X* x, D* d, int = 0) {
    X inverse[Group::kAmbient];
    D step[Group::kAmbient];
    Group::Inverse(x, inverse);
    Group::Multiply(y, inverse, step);
    Group::Log(step, d);
  }
  static void PlusJacobian(const double*, const double* d, double* j) { Group::LeftJacobian(d, j); }
  static void PlusJacobianX(const double*, const double* d, double* j) {
    double step[Group::kAmbient];
    Group::Exp(d, step);
    Group::Adjoint(step, j);
  }
};

}  // namespace alidade
