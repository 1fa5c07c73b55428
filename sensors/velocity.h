// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Velocity of a point on a body, in the frame of the world, in the plane (D = 2) or in space
/// (D = 3): the Doppler velocity of a GNSS receiver.
///
///   model      z = v + R (omega x l) + n,   n ~ N(0, diag(sigma^2))
///   Jacobian   automatic differentiation               D x (D + attitude + rate + D)
///   noise      R_z = diag(sigma^2), or the covariance of the measurement       D x D, m^2/s^2
///   inverse    v = z - R (omega x l)
///
///   symbol     shape  unit    frame  meaning
///   z          D      m/s     world  velocity of the sensor
///   v          D      m/s     world  velocity of the body
///   R          -      rad, -  -      attitude of the body, world_from_body: a heading for
///                                    D = 2, an orientation for D = 3; optional, else identity
///   omega      1, 3   rad/s   body   turn rate for D = 2, angular velocity for D = 3; optional, by
///                                    default 0
///   l          D      m       body   lever arm, the position of the sensor on the body: a model
///                                    parameter state, by default constant at 0
///   sigma      1      m/s     world  standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       lever arm [Groves2013] sec. 14.3.2.
template <int D>
struct Velocity
    : Sensor<Vec<D>, Vec<D>, typename Body<D>::Rotation, typename Body<D>::Rate, Vec<D>> {
  static constexpr std::array kRoles{
      Quantity{"velocity", "m/s", "velocity of the body in the world", kAxes<D>},
      Body<D>::Attitude(ALIDADE_ROLE_OPTIONAL), Body<D>::AngularVelocity(ALIDADE_ROLE_OPTIONAL),
      LeverArm<D>()};
  static constexpr Quantity kMeasurement{"velocity", "m/s", "velocity of the sensor in the world",
                                         kAxes<D>};
  static constexpr int kInitialises = 0;

  std::array<double, D> sigma_m_s;

  explicit Velocity(const std::array<double, D>& sigma) : sigma_m_s(sigma) {}
  explicit Velocity(Params& p)
      : Velocity(
            p.PerAxis<D>("sigma_m_s", "m/s", "standard deviation of the velocity", kPositive)) {}

  template <class T>
  bool Predict(const T* velocity, const T* attitude, const T* omega, const T* lever_arm,
               T* z) const {
    AroundBody(attitude, omega, lever_arm, z);
    for (int i = 0; i < D; ++i) z[i] += velocity[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < D; ++i) L[(D + 1) * i] = T(sigma_m_s[static_cast<std::size_t>(i)]);
  }
  template <class T>
  bool Initialise(const T* attitude, const T* omega, const T* lever_arm, const T* z,
                  T* velocity) const {
    AroundBody(attitude, omega, lever_arm, velocity);
    for (int i = 0; i < D; ++i) velocity[i] = z[i] - velocity[i];
    return true;
  }

 private:
  /// Computes R (omega x l), the velocity of the sensor relative to the body.
  template <class T>
  static void AroundBody(const T* attitude, const T* omega, const T* lever_arm, T* y) {
    T in_body[D] = {};
    if (omega != nullptr) Body<D>::Cross(omega, lever_arm, in_body);
    Body<D>::Rotate(attitude, in_body, y);
  }
};

}  // namespace alidade
