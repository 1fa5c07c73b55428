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
struct SpecificForce : WorldVectorSensor {
  static constexpr std::array kRoles{
      Body<3>::Attitude(),
      Quantity{"bias", "m/s^2", "bias of the accelerometer", "x,y,z", ALIDADE_ROLE_OWNED},
      Body<3>::Mounting()};
  static constexpr Quantity kMeasurement{"specific_force", "m/s^2",
                                         "specific force in the frame of the sensor", "x,y,z"};

  double max_acceleration_m_s2;

  explicit SpecificForce(const std::array<double, 3>& sigma_m_s2,
                         const std::array<double, 3>& gravity_m_s2 = {0.0, 0.0, -9.80665},
                         double max_acceleration = std::numeric_limits<double>::infinity())
      : WorldVectorSensor(sigma_m_s2, {-gravity_m_s2[0], -gravity_m_s2[1], -gravity_m_s2[2]}),
        max_acceleration_m_s2(max_acceleration) {}
  explicit SpecificForce(Params& p)
      : SpecificForce{
            p.PerAxis<3>("sigma_m_s2", "m/s^2", "standard deviation of the specific force",
                         kPositive),
            p.Vector<3>("gravity_m_s2", "m/s^2", "gravity in the world", Range{},
                        std::array<double, 3>{0.0, 0.0, -9.80665}),
            p.NumberOrNone("max_acceleration_m_s2", "m/s^2",
                           "largest valid difference of the lengths of z and gravity", kPositive)
                .value_or(std::numeric_limits<double>::infinity())} {}

  bool Valid(const double* z) const {
    const auto length = [](const double* x) {
      return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    };
    return std::abs(length(z) - length(vector_in_world.data())) <= max_acceleration_m_s2;
  }
};

}  // namespace alidade
