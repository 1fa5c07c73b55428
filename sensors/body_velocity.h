// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Velocity of a point on a body, in the frame of the sensor, along M of the D axes, in the plane
/// (D = 2) or in space (D = 3): wheel speed, Doppler velocity log. With z = 0 along the y axis: a
/// vehicle that does not slip sideways. If the velocity in the frame of the body is a block, as in
/// planar_body_velocity, the sensor `direct` measures it.
///
///   model      z = S B' (R' v + omega x l) + n,   n ~ N(0, diag(sigma^2))
///   Jacobian   automatic differentiation               M x roles
///   noise      R_z = diag(sigma^2), or the covariance of the measurement       M x M, m^2/s^2
///
///   symbol     shape  unit    frame  meaning
///   z          M      m/s     sensor velocity of the sensor along the measured axes
///   S          M x D  -       -      selects the axes of the key `axes`
///   v          D      m/s     world  velocity of the body
///   R          -      rad, -  -      attitude of the body, world_from_body: a heading for
///                                    D = 2, an orientation for D = 3
///   omega      1, 3   rad/s   body   turn rate for D = 2, angular velocity for D = 3; optional, by
///                                    default 0
///   l          D      m       body   lever arm, the position of the sensor on the body
///   B          -      rad, -  -      mounting of the sensor, body_from_sensor
///   sigma      1      m/s     sensor standard deviation for each measured axis; > 0
///
/// l and B are model parameter states, by default constant at the neutral element.
///
/// Defined everywhere.
/// Source       [Groves2013] sec. 6.4 (Doppler), 15.4.1 (land vehicle constraints).
template <int D, int M>
struct BodyVelocity : Sensor<Vec<M>, Vec<D>, typename Body<D>::Rotation, typename Body<D>::Rate,
                             Vec<D>, typename Body<D>::Rotation> {
  static constexpr std::array kRoles{
      Quantity{"velocity", "m/s", "velocity of the body in the world", kAxes<D>},
      Body<D>::Attitude(), Body<D>::AngularVelocity(ALIDADE_ROLE_OPTIONAL), LeverArm<D>(),
      Body<D>::Mounting()};
  static constexpr Quantity kMeasurement{"velocity", "m/s",
                                         "velocity along the measured axes of the sensor"};

  std::array<int, M> axes;  ///< measured axes: 0 for x, 1 for y, 2 for z
  std::array<double, M> sigma_m_s;

  BodyVelocity(const std::array<int, M>& measured_axes, const std::array<double, M>& sigma)
      : axes(measured_axes), sigma_m_s(sigma) {}
  BodyVelocity(const std::array<int, M>& measured_axes, Params& p)
      : BodyVelocity(measured_axes,
                     p.PerAxis<M>("sigma_m_s", "m/s",
                                  "standard deviation of the velocity along each measured axis",
                                  kPositive)) {}

  template <class T>
  bool Predict(const T* velocity, const T* attitude, const T* omega, const T* lever_arm,
               const T* mounting, T* z) const {
    T in_body[D], around[D] = {}, in_sensor[D];
    Body<D>::RotateBack(attitude, velocity, in_body);
    if (omega != nullptr) Body<D>::Cross(omega, lever_arm, around);
    for (int i = 0; i < D; ++i) in_body[i] += around[i];
    Body<D>::RotateBack(mounting, in_body, in_sensor);
    for (int i = 0; i < M; ++i) z[i] = in_sensor[axes[static_cast<std::size_t>(i)]];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < M; ++i) L[(M + 1) * i] = T(sigma_m_s[static_cast<std::size_t>(i)]);
  }
};

}  // namespace alidade
