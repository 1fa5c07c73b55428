// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "alidade/model/geometry.h"

/// Motion of a body whose velocities are constant in its own frame: an arc in the plane, a helix in
/// space.
namespace alidade {

/// Computes the pose in the plane after a displacement of which each part turns with the body:
///
///   r' = r + c_1(phi^2/4) R(h + phi/2) d,   h' = h + phi
///
/// `displacement` d (2, m) is velocity times duration in the frame of the body, and `turn` phi (1,
/// rad) is turn rate times duration. The formula holds for every phi. r has 2 elements.
template <class T>
void MoveAlongArc(const T* position, const T* heading, const T* displacement, const T& turn,
                  T* next_position, T* next_heading) {
  using std::cos;
  using std::sin;
  const T chord = StumpffFunctions<T>(0.25 * turn * turn).c1, direction = heading[0] + 0.5 * turn;
  const T c = chord * cos(direction), s = chord * sin(direction);
  const T x = c * displacement[0] - s * displacement[1],
          y = s * displacement[0] + c * displacement[1];
  next_position[0] = position[0] + x;
  next_position[1] = position[1] + y;
  Angle::Plus(heading, &turn, next_heading);
}

/// Computes y = Gamma_M(phi) x, the M-fold integral of a vector that turns with a body, as seen
/// from the body before the turn:
///
///   Gamma_M(phi) = I/M! + c_(M+1) [phi]x + c_(M+2) [phi]x^2,   c_n = c_n(|phi|^2)
///
/// Gamma_0 = Exp(phi). Gamma_1 is the left Jacobian of SO(3): Gamma_1(omega t) v t is the
/// displacement of a body with the velocities v and omega in its own frame. Gamma_2(omega t) a t^2
/// is the displacement due to an acceleration a. `turn` phi has 3 elements in rad. Source:
/// [Hartley2020] sec. 3.4.
template <int M, class T>
void IntegrateTurn(const T* turn, const T* x, T* y) {
  const auto cross = [turn](const T* b, T* c) {
    c[0] = turn[1] * b[2] - turn[2] * b[1];
    c[1] = turn[2] * b[0] - turn[0] * b[2];
    c[2] = turn[0] * b[1] - turn[1] * b[0];
  };
  const T angle2 = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2];
  const StumpffFunctions<T> s(angle2);
  const T a = M == 0 ? s.c1 : M == 1 ? s.c2 : s.c3, b = M == 0 ? s.c2 : M == 1 ? s.c3 : s.c4;
  constexpr double kFirst = M == 2 ? 0.5 : 1.0;
  static_assert(M >= 0 && M <= 2, "higher integrals need another first coefficient");
  T once[3], twice[3];
  cross(x, once);
  cross(once, twice);
  for (int i = 0; i < 3; ++i) y[i] = kFirst * x[i] + a * once[i] + b * twice[i];
}

}  // namespace alidade
