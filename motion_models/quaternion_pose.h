// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/process_noise.h"

namespace alidade {

/// Rigid body with constant velocities and random accelerations. The linear and angular
/// acceleration are constant between two updates (discrete noise, DWNA).
///
///   model      v' = v + a dt,           r' = r + v' dt
///              omega' = omega + alpha dt,   q' = q Exp(omega' dt)
///   noise      w = (a, alpha) ~ N(0, diag(sigma_a^2, sigma_alpha^2)). G is 12 x 6, of rank 6.
///              n intervals in a second add sigma_a^2 / n to Var(v), so Var(v) depends on the rate
///              of the measurements
///   Jacobian   automatic differentiation               12 x 12; exact at omega = 0
///
///   symbol          shape  unit           frame  meaning
///   r               3      m              world  position
///   q               4      -              -      orientation, world_from_body
///   v               3      m/s            world  velocity
///   omega           3      rad/s          body   angular velocity
///   sigma_a         3      m/s^2          world  standard deviation of a, for each axis; >= 0
///   sigma_alpha     3      rad/s^2        body   standard deviation of alpha, for each axis; >= 0
///
/// Defined everywhere. Steps without noise are additive in dt. For a camera, the frame `body` is
/// `cam`. Because r' depends on v', the noise of r over an interval depends on the division of the
/// interval into steps, but not to first order in dt.
/// Source       [MonoSlam2015] sec. 4.3, [Davison2007] sec. 3.4.
struct QuaternionPose : Motion<6, Vec<3>, UnitQuaternion, Vec<3>, Vec<3>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"},
      Quantity{"velocity", "m/s", "velocity of the body in the world", "x,y,z"},
      Quantity{"angular_velocity", "rad/s", "angular velocity in the frame of the body", "x,y,z"}};

  std::array<double, 3> sigma_a, sigma_alpha;

  QuaternionPose(const std::array<double, 3>& acceleration,
                 const std::array<double, 3>& angular_acceleration)
      : sigma_a(acceleration), sigma_alpha(angular_acceleration) {}
  explicit QuaternionPose(Params& p)
      : QuaternionPose{
            p.PerAxis<3>("noise.linear_acceleration", "m/s^2",
                         "standard deviation of the acceleration", kNonNegative),
            p.PerAxis<3>("noise.angular_acceleration", "rad/s^2",
                         "standard deviation of the angular acceleration", kNonNegative)} {}

  NoiseKind noise_kind() const { return NoiseKind::kDiscrete; }
  template <class T>
  void Step(const T* r, const T* q, const T* v, const T* omega, const T* w, double dt_s, T* r1,
            T* q1, T* v1, T* omega1) const {
    T turn[3];
    for (int i = 0; i < 3; ++i) {
      v1[i] = v[i] + dt_s * w[i];
      r1[i] = r[i] + dt_s * v1[i];
      omega1[i] = omega[i] + dt_s * w[3 + i];
      turn[i] = dt_s * omega1[i];
    }
    UnitQuaternion::Plus(q, turn, q1);
  }
  void SqrtQ(double, MatrixRef Lq) const {
    for (std::size_t i = 0; i < 3; ++i) {
      const int k = static_cast<int>(i);
      Lq(k, k) = sigma_a[i];
      Lq(3 + k, 3 + k) = sigma_alpha[i];
    }
  }
};

/// Rigid body like QuaternionPose, but with white accelerations (continuous noise, CWNA). The
/// division of dt into steps does not change Q.
///
///   model      r' = r + v dt + w_r,     q' = q Exp(omega dt + w_q)
///              v' = v + w_v,            omega' = omega + w_omega
///   noise      w ~ N(0, Lq Lq'). For each axis,
///              Cov(w_r, w_v) = sigma_a^2 [dt^3/3 dt^2/2; dt^2/2 dt]. Cov(w_q, w_omega) has this
///              form with sigma_alpha, which is exact for omega = 0, else correct to first order
///   Jacobian   F = [I 0 dt I 0; 0 R(Exp(-phi)) 0 dt J(phi); 0 0 I 0; 0 0 0 I],
///              phi = omega dt + w_q
///              G = diag(I, J(phi), I, I),  J(phi) = d Log(Exp(-phi) Exp(phi + d))/dd
///                = I - (1 - cos)/|phi|^2 [phi]x + (|phi| - sin)/|phi|^3 [phi]x^2      12 x 12
///
///   symbol          shape  unit           frame  meaning
///   sigma_a         3      m/s^1.5        world  root of the spectral density of the acceleration,
///                                                for each axis; >= 0
///   sigma_alpha     3      rad/s^1.5      body   root of the spectral density of the angular
///                                                acceleration, for each axis; >= 0
///
/// Defined everywhere. docs/noise_models.md compares both kinds of noise and converts sigma.
/// Source       [BarShalom2001] sec. 6.2; J: [Sola2017] sec. 4.3.
struct ContinuousQuaternionPose : Motion<12, Vec<3>, UnitQuaternion, Vec<3>, Vec<3>> {
  static constexpr std::array kBlocks = QuaternionPose::kBlocks;

  WhiteBodyAcceleration noise;

  ContinuousQuaternionPose(const std::array<double, 3>& acceleration,
                           const std::array<double, 3>& angular_acceleration)
      : noise{acceleration, angular_acceleration} {}
  explicit ContinuousQuaternionPose(Params& p) : noise(WhiteBodyAcceleration::Read(p)) {}

  template <class T>
  void Step(const T* r, const T* q, const T* v, const T* omega, const T* w, double dt_s, T* r1,
            T* q1, T* v1, T* omega1) const {
    T turn[3];
    for (int i = 0; i < 3; ++i) {
      r1[i] = r[i] + dt_s * v[i] + w[i];
      turn[i] = dt_s * omega[i] + w[3 + i];
      v1[i] = v[i] + w[6 + i];
      omega1[i] = omega[i] + w[9 + i];
    }
    UnitQuaternion::Plus(q, turn, q1);
  }
  void StepJacobian(const double*, const double*, const double*, const double* omega,
                    const double* w, double dt_s, MatrixRef f, MatrixRef g) const {
    double phi[3], minus_phi[3], rotation[4], j[9];
    for (int i = 0; i < 3; ++i) phi[i] = dt_s * omega[i] + w[3 + i];
    for (int i = 0; i < 3; ++i) minus_phi[i] = -phi[i];
    UnitQuaternion::Exp(minus_phi, rotation);
    Rotation::RightJacobian(phi, j);
    for (int c = 0; c < 3; ++c) {
      f(c, c) = f(6 + c, 6 + c) = f(9 + c, 9 + c) = 1.0;
      g(c, c) = g(6 + c, 6 + c) = g(9 + c, 9 + c) = 1.0;
      f(c, 6 + c) = dt_s;
      const double axis[3] = {c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0};
      double rotated_axis[3];
      UnitQuaternion::Rotate(rotation, axis, rotated_axis);
      for (int i = 0; i < 3; ++i) {
        f(3 + i, 3 + c) = rotated_axis[i];
        f(3 + i, 9 + c) = dt_s * j[3 * i + c];
        g(3 + i, 3 + c) = j[3 * i + c];
      }
    }
  }
  void SqrtQ(double dt_s, MatrixRef Lq) const { noise.SqrtQ(dt_s, Lq); }
};

}  // namespace alidade
