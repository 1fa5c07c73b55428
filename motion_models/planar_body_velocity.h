// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Body in the plane whose velocity in its own frame and turn rate are nearly constant. It may move
/// sideways.
///
///   model      d = v dt + w_d,   phi = omega dt + w_h
///              r' = r + sin(phi/2)/(phi/2) R(h + phi/2) d,   h' = h + phi
///              v' = v + w_v,     omega' = omega + w_omega
///   noise      continuous: w ~ N(0, Q) is the effect of white accelerations. For each axis of the
///              body, Cov(w_d, w_v) = sigma_v^2 [dt^3/3 dt^2/2; dt^2/2 dt]; Cov(w_h, w_omega) has
///              this form with sigma_omega. Exact for v, h and omega; correct to first order for r
///   Jacobian   automatic differentiation               6 x 6; exact at omega = 0
///
///   symbol       shape  unit       frame  meaning
///   r            2      m          world  position
///   h            1      rad        world  heading, from x to y
///   v            2      m/s        body   velocity
///   omega        1      rad/s      -      turn rate
///   sigma_v      2      m/s^1.5    body   root of the spectral density of dv/dt per axis; >= 0
///   sigma_omega  1      rad/s^1.5  -      root of the spectral density of domega/dt; >= 0
///
/// Defined everywhere. Steps without noise are exact. For a vehicle that hardly moves sideways,
/// sigma_v of the second axis and the initial value of v_y are small.
/// Source       [Moore2014] (mode in two dimensions).
struct PlanarBodyVelocity : Motion<6, Vec<2>, Angle, Vec<2>, Vec<1>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position in the world", "x,y"},
      Quantity{"heading", "rad", "heading, from x to y"},
      Quantity{"body_velocity", "m/s", "velocity in the frame of the body", "x,y"},
      Quantity{"turn_rate", "rad/s", "turn rate"}};

  std::array<double, 2> sigma_v;
  double sigma_omega;

  PlanarBodyVelocity(const std::array<double, 2>& acceleration, double angular_acceleration)
      : sigma_v(acceleration), sigma_omega(angular_acceleration) {}
  explicit PlanarBodyVelocity(Params& p)
      : PlanarBodyVelocity{
            p.PerAxis<2>("noise.linear_acceleration", "m/s^1.5",
                         "root of the spectral density of the acceleration", kNonNegative),
            p.NonNegative("noise.angular_acceleration", "rad/s^1.5",
                          "root of the spectral density of the angular acceleration")} {}

  template <class T>
  void Step(const T* r, const T* h, const T* v, const T* omega, const T* w, double dt_s, T* r1,
            T* h1, T* v1, T* omega1) const {
    const T displacement[2] = {dt_s * v[0] + w[0], dt_s * v[1] + w[1]};
    MoveAlongArc(r, h, displacement, T(dt_s * omega[0] + w[2]), r1, h1);
    v1[0] = v[0] + w[3];
    v1[1] = v[1] + w[4];
    omega1[0] = omega[0] + w[5];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    SetWhiteAcceleration(sigma_v[0], dt_s, 0, 3, l);
    SetWhiteAcceleration(sigma_v[1], dt_s, 1, 4, l);
    SetWhiteAcceleration(sigma_omega, dt_s, 2, 5, l);
  }
};

}  // namespace alidade
