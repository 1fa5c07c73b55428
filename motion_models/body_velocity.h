// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Rigid body whose velocities in its own frame are nearly constant.
///
///   model      d = v dt + w_d,   phi = omega dt + w_q
///              r' = r + R(q) Gamma_1(phi) d,   q' = q Exp(phi)
///              v' = v + w_v,     omega' = omega + w_omega
///              Gamma_1(phi) = I + (1 - cos)/|phi|^2 [phi]x + (|phi| - sin)/|phi|^3 [phi]x^2
///   noise      continuous: w ~ N(0, Q) is the effect of white accelerations. For each axis of the
///              body, Cov(w_d, w_v) = sigma_v^2 [dt^3/3 dt^2/2; dt^2/2 dt]; Cov(w_q, w_omega) has
///              this form with sigma_omega. Exact for v and omega; correct to first order for r, q
///   Jacobian   automatic differentiation               12 x 12; exact at omega = 0
///
///   symbol       shape  unit       frame  meaning
///   r            3      m          world  position
///   q            4      -          -      orientation, world_from_body
///   v            3      m/s        body   velocity
///   omega        3      rad/s      body   angular velocity
///   sigma_v      3      m/s^1.5    body   root of the spectral density of dv/dt per axis; >= 0
///   sigma_omega  3      rad/s^1.5  body   root of the spectral density of domega/dt, for each
///                                         axis; >= 0
///
/// Defined everywhere. Steps without noise are exact: a helix. quaternion_pose has its velocity in
/// the world instead.
/// Source       [Moore2014] (without accelerations); Gamma_1: [Hartley2020] sec. 3.4.
struct BodyVelocityMotion : Motion<12, Vec<3>, UnitQuaternion, Vec<3>, Vec<3>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"},
      Quantity{"body_velocity", "m/s", "velocity in the frame of the body", "x,y,z"},
      Quantity{"angular_velocity", "rad/s", "angular velocity in the frame of the body", "x,y,z"}};

  WhiteBodyAcceleration noise;

  BodyVelocityMotion(const std::array<double, 3>& acceleration,
                     const std::array<double, 3>& angular_acceleration)
      : noise{acceleration, angular_acceleration} {}
  explicit BodyVelocityMotion(Params& p) : noise(WhiteBodyAcceleration::Read(p)) {}

  template <class T>
  void Step(const T* r, const T* q, const T* v, const T* omega, const T* w, double dt_s, T* r1,
            T* q1, T* v1, T* omega1) const {
    T displacement[3], turn[3], integrated[3], rotated[3];
    for (int i = 0; i < 3; ++i) {
      displacement[i] = dt_s * v[i] + w[i];
      turn[i] = dt_s * omega[i] + w[3 + i];
      v1[i] = v[i] + w[6 + i];
      omega1[i] = omega[i] + w[9 + i];
    }
    IntegrateTurn<1>(turn, displacement, integrated);
    UnitQuaternion::Rotate(q, integrated, rotated);
    for (int i = 0; i < 3; ++i) r1[i] = r[i] + rotated[i];
    UnitQuaternion::Plus(q, turn, q1);
  }
  void SqrtQ(double dt_s, MatrixRef l) const { noise.SqrtQ(dt_s, l); }
};

}  // namespace alidade
