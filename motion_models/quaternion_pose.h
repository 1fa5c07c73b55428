// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model.h"

namespace alidade {

/// A rigid body that moves and turns with constant velocity but for random accelerations.
///
///   model      v' = v + a dt,           r' = r + v' dt
///              omega' = omega + alpha dt,   q' = q Exp(omega' dt)
///   noise      w = (a, alpha) ~ N(0, diag(sigma_a^2, sigma_alpha^2)), constant during a step;
///              G is 12 x 6: rank 6
///   Jacobian   derived                                 12 x 12; exact at omega = 0
///
///   symbol          shape  unit           frame  meaning
///   r               3      m              world  position
///   q               4      -              -      orientation, world_from_body
///   v               3      m/s            world  velocity
///   omega           3      rad/s          body   angular velocity
///   sigma_a         3      m/s^2          world  acceleration, per axis; >= 0
///   sigma_alpha     3      rad/s^2        body   angular acceleration, per axis; >= 0
///
/// Defined everywhere. Additive in dt without noise. For a camera, body is cam.
/// Source       [MonoSlam2015] sec. 4.3, [Davison2007] sec. 3.4.
struct QuaternionPose : Motion<6, Vec<3>, UnitQuaternion, Vec<3>, Vec<3>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "in the world", "x,y,z"},
      Quantity{"orientation", "", "world_from_body", "w,x,y,z"},
      Quantity{"velocity", "m/s", "in the world", "x,y,z"},
      Quantity{"angular_velocity", "rad/s", "in the body", "x,y,z"}};

  std::array<double, 3> sigma_a, sigma_alpha;

  QuaternionPose(const std::array<double, 3>& acceleration,
                 const std::array<double, 3>& angular_acceleration)
      : sigma_a(acceleration), sigma_alpha(angular_acceleration) {}
  explicit QuaternionPose(Params& p)
      : QuaternionPose(p.PerAxis<3>("noise.linear_acceleration", "m/s^2",
                                    "random acceleration, 1 sigma", kNonNegative),
                       p.PerAxis<3>("noise.angular_acceleration", "rad/s^2",
                                    "random angular acceleration, 1 sigma", kNonNegative)) {}

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

}  // namespace alidade
