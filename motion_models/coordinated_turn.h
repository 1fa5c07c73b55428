// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Target in the plane with nearly constant speed and turn rate.
///
///   model      s = v dt + w_s,   phi = omega dt + w_h
///              r' = r + s sin(phi/2)/(phi/2) [cos(h + phi/2); sin(h + phi/2)],   h' = h + phi
///              v' = v + w_v,     omega' = omega + w_omega
///   noise      continuous: w ~ N(0, Q) is the effect of white accelerations along the path and
///              of the turn. Cov(w_s, w_v) = sigma_v^2 [dt^3/3 dt^2/2; dt^2/2 dt], and
///              Cov(w_h, w_omega) has this form with sigma_omega. Exact for v, h and omega;
///              correct to first order for r
///   Jacobian   automatic differentiation               5 x 5; exact at omega = 0
///
///   symbol       shape  unit       frame  meaning
///   r            2      m          world  position
///   h            1      rad        world  heading: direction of the velocity, from x to y
///   v            1      m/s        -      speed
///   omega        1      rad/s      -      turn rate
///   sigma_v      1      m/s^1.5    -      root of the spectral density of dv/dt; >= 0
///   sigma_omega  1      rad/s^1.5  -      root of the spectral density of domega/dt; >= 0
///
/// Defined everywhere. Steps without noise are exact: an arc of a circle.
/// Source       [BarShalom2001] sec. 11.7.
struct CoordinatedTurn : Motion<4, Vec<2>, Angle, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position in the world", "x,y"},
      Quantity{"heading", "rad", "direction of the velocity, from x to y"},
      Quantity{"speed", "m/s", "speed"}, Quantity{"turn_rate", "rad/s", "turn rate"}};

  double sigma_v, sigma_omega;

  CoordinatedTurn(double acceleration, double angular_acceleration)
      : sigma_v(acceleration), sigma_omega(angular_acceleration) {}
  explicit CoordinatedTurn(Params& p)
      : CoordinatedTurn{p.NonNegative("noise.acceleration", "m/s^1.5",
                                      "root of the spectral density of the acceleration"),
                        p.NonNegative("noise.angular_acceleration", "rad/s^1.5",
                                      "root of the spectral density of the angular acceleration")} {
  }

  template <class T>
  void Step(const T* r, const T* h, const T* v, const T* omega, const T* w, double dt_s, T* r1,
            T* h1, T* v1, T* omega1) const {
    const T displacement[2] = {dt_s * v[0] + w[0], T(0.0)};
    MoveAlongArc(r, h, displacement, T(dt_s * omega[0] + w[1]), r1, h1);
    v1[0] = v[0] + w[2];
    omega1[0] = omega[0] + w[3];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    SetWhiteAcceleration(sigma_v, dt_s, 0, 2, l);
    SetWhiteAcceleration(sigma_omega, dt_s, 1, 3, l);
  }
};

}  // namespace alidade
