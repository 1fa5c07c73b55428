// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "alidade/model/body.h"

namespace alidade {

/// Specific force of a body that stands, or turns without acceleration: an accelerometer as a
/// sensor of roll and pitch.
///
///   model      z = B' R' (-g) + b + n,   n ~ N(0, diag(sigma^2))
///   Jacobian   automatic differentiation               3 x 9
///   noise      R_z = diag(sigma^2), or the covariance of the measurement       3x3, m^2/s^4
///
///   symbol     shape  unit    frame  meaning
///   z          3      m/s^2   sensor specific force
///   R          4      -       -      orientation of the body, world_from_body
///   g          3      m/s^2   world  gravity; default: (0, 0, -9.80665)
///   b          3      m/s^2   sensor bias: a model parameter state, default: constant at 0
///   B          4      -       -      mounting, body_from_sensor: a model parameter state, default:
///                                    constant at the identity
///   sigma      1      m/s^2   sensor standard deviation for each axis; > 0
///   e_max      1      m/s^2   -      max_acceleration_m_s2: largest valid | |z| - |g| |
///
/// Defined everywhere.
/// Valid for    | |z| - |g| | <= e_max. Other measurements are invalid: the body accelerates.
/// Source       [Groves2013] sec. 5.6.1 (leveling).
struct SpecificForce : Sensor<Vec<3>, UnitQuaternion, Vec<3>, UnitQuaternion> {
  static constexpr std::array kRoles{
      Body<3>::Attitude(),
      Quantity{"bias", "m/s^2", "bias of the accelerometer", "x,y,z", ALIDADE_ROLE_OWNED},
      Body<3>::Mounting()};
  static constexpr Quantity kMeasurement{"specific_force", "m/s^2",
                                         "specific force in the frame of the sensor", "x,y,z"};

  std::array<double, 3> sigma_m_s2, gravity_m_s2;
  double max_acceleration_m_s2;

  explicit SpecificForce(const std::array<double, 3>& sigma,
                         const std::array<double, 3>& gravity = {0.0, 0.0, -9.80665},
                         double max_acceleration = std::numeric_limits<double>::infinity())
      : sigma_m_s2(sigma), gravity_m_s2(gravity), max_acceleration_m_s2(max_acceleration) {}
  explicit SpecificForce(Params& p)
      : SpecificForce(
            p.PerAxis<3>("sigma_m_s2", "m/s^2", "standard deviation of the specific force",
                         kPositive),
            p.Vector<3>("gravity_m_s2", "m/s^2", "gravity in the world", Range{},
                        std::array<double, 3>{0.0, 0.0, -9.80665}),
            p.NumberOrNone("max_acceleration_m_s2", "m/s^2",
                           "largest valid difference of the lengths of z and gravity", kPositive)
                .value_or(std::numeric_limits<double>::infinity())) {}

  template <class T>
  bool Predict(const T* orientation, const T* bias, const T* mounting, T* z) const {
    const T reaction[3] = {T(-gravity_m_s2[0]), T(-gravity_m_s2[1]), T(-gravity_m_s2[2])};
    T in_body[3];
    Body<3>::RotateBack(orientation, reaction, in_body);
    Body<3>::RotateBack(mounting, in_body, z);
    for (int i = 0; i < 3; ++i) z[i] += bias[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < 3; ++i) L[4 * i] = T(sigma_m_s2[static_cast<std::size_t>(i)]);
  }
  bool Valid(const double* z) const {
    const auto& g = gravity_m_s2;
    const double length = std::sqrt(z[0] * z[0] + z[1] * z[1] + z[2] * z[2]);
    return std::abs(length - std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])) <=
           max_acceleration_m_s2;
  }
};

}  // namespace alidade
