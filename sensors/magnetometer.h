// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Magnetic field of the Earth, measured on a body.
///
///   model      z = B' R' m + b + n,   n ~ N(0, diag(sigma^2))
///              m = F (cos I sin D, cos I cos D, -sin I)    if the config states F, I and D
///   Jacobian   automatic differentiation               3 x 9
///   noise      R_z = diag(sigma^2), or the covariance of the measurement       3x3, uT^2
///
///   symbol     shape  unit    frame  meaning
///   z          3      uT      sensor magnetic field
///   R          4      -       -      orientation of the body, world_from_body
///   m          3      uT      world  field of the Earth
///   F, I, D    1      uT, rad -      strength, inclination (down > 0) and declination (east > 0),
///                                    in a world whose x is east, y north and z up
///   b          3      uT      sensor hard iron: a model parameter state, default: constant at 0
///   B          4      -       -      mounting, body_from_sensor: a model parameter state, default:
///                                    constant at the identity
///   sigma      1      uT      sensor standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       [Groves2013] sec. 6.1.1.
struct Magnetometer : WorldVectorSensor {
  static constexpr std::array kRoles{
      Body<3>::Attitude(),
      Quantity{"hard_iron", "uT", "field of the body itself", "x,y,z", ALIDADE_ROLE_OWNED},
      Body<3>::Mounting()};
  static constexpr Quantity kMeasurement{"magnetic_field", "uT",
                                         "magnetic field in the frame of the sensor", "x,y,z"};

  Magnetometer(const std::array<double, 3>& sigma_ut, const std::array<double, 3>& field_ut)
      : WorldVectorSensor(sigma_ut, field_ut) {}
  explicit Magnetometer(Params& p)
      : Magnetometer{p.PerAxis<3>("sigma_ut", "uT", "standard deviation of the field", kPositive),
                     ReadField(p)} {}

  /// Returns m for a world whose x is east, y north and z up.
  static std::array<double, 3> FieldOf(double strength_ut, double inclination_rad,
                                       double declination_rad) {
    const double horizontal = strength_ut * std::cos(inclination_rad);
    return {horizontal * std::sin(declination_rad), horizontal * std::cos(declination_rad),
            -strength_ut * std::sin(inclination_rad)};
  }

 private:
  static std::array<double, 3> ReadField(Params& p) {
    const auto strength =
        p.NumberOrNone("strength_ut", "uT",
                       "strength of the field, with inclination_rad and declination_rad; "
                       "replaces field_ut",
                       kPositive);
    if (!strength) return p.Vector<3>("field_ut", "uT", "field of the Earth in the world");
    const double inclination =
        p.Number("inclination_rad", "rad", "inclination of the field; > 0 downwards");
    return FieldOf(*strength, inclination,
                   p.Number("declination_rad", "rad", "declination; > 0 to the east", {}, 0.0));
  }
};

}  // namespace alidade
