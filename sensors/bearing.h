// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Direction from a body to a known point. The point is a parameter of the sensor, or each
/// measurement contains it. In the plane, the direction is an angle (Bearing). In space, it is a
/// unit vector (BearingUnitVector), or azimuth and elevation (BearingAngles).
///
///   model      z = atan2(h_y, h_x) (+) n                            bearing or azimuth
///              z = atan2(h_z, sqrt(h_x^2 + h_y^2)) (+) n            elevation
///              z = h / |h| (+) n                                    unit vector
///              h = B' (R' (a - p) - l),   n ~ N(0, sigma^2 I)
///   Jacobian   automatic differentiation               1 x 6, 2 x 12
///   noise      R_z = sigma^2 I, or the covariance of the measurement           rad^2
///
///   symbol     shape  unit    frame  meaning
///   p          2, 3   m       world  position of the body
///   R          -      rad, -  -      attitude, world_from_body: a heading in the plane,
///                                    an orientation in space
///   a          2, 3   m       world  the point, known
///   l, B       -      m, -    body   lever arm and mounting (body_from_sensor): model
///                                    parameter states, default: constant at the neutral element
///   sigma      1      rad     -      standard deviation of each angle; > 0
///
/// Defined for  h != 0; azimuth and elevation for h_x or h_y != 0. Otherwise out_of_domain; outputs
///              unchanged.
/// Source       [Thrun2005] sec. 6.6; unit vector [Duff2017].
template <int D, class Z>
struct DirectionToPoint
    : Sensor<Z, Vec<D>, typename Body<D>::Rotation, Vec<D>, typename Body<D>::Rotation> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", kAxes<D>}, Body<D>::Attitude(),
      LeverArm<D>(), Body<D>::Mounting()};
  using Known = Vec<D>;
  static constexpr Quantity kKnown{"point", "m", "position of the point in the world", kAxes<D>};
  static constexpr const char* kFixedKey = "point_m";

  double sigma_rad;

  explicit DirectionToPoint(double sigma) : sigma_rad(sigma) {}
  explicit DirectionToPoint(Params& p)
      : DirectionToPoint(p.Positive("sigma_rad", "rad", "standard deviation of each angle")) {}

  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, const double*, T* L) const {
    for (int i = 0; i < Z::kTangent; ++i) L[(Z::kTangent + 1) * i] = T(sigma_rad);
  }
};

struct Bearing : DirectionToPoint<2, Angle> {
  static constexpr Quantity kMeasurement{"bearing", "rad", "bearing, counter-clockwise"};
  using DirectionToPoint::DirectionToPoint;

  template <class T>
  bool Predict(const T* position, const T* heading, const T* lever_arm, const T* mounting,
               const double* point, T* z) const {
    using std::atan2;
    T h[2];
    InSensor<2>(position, heading, lever_arm, mounting, point, h);
    if (!(h[0] * h[0] + h[1] * h[1] > T(0.0))) return false;
    z[0] = atan2(h[1], h[0]);
    return true;
  }
};

struct BearingUnitVector : DirectionToPoint<3, UnitVector> {
  static constexpr Quantity kMeasurement{"bearing", "", "direction in the frame of the sensor",
                                         "x,y,z"};
  using DirectionToPoint::DirectionToPoint;

  template <class T>
  bool Predict(const T* position, const T* orientation, const T* lever_arm, const T* mounting,
               const double* point, T* z) const {
    using std::sqrt;
    T h[3];
    InSensor<3>(position, orientation, lever_arm, mounting, point, h);
    const T squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
    if (!(squared > T(0.0))) return false;
    const T length = sqrt(squared);
    for (int i = 0; i < 3; ++i) z[i] = h[i] / length;
    return true;
  }
};

struct BearingAngles : DirectionToPoint<3, Product<Angle, Angle>> {
  static constexpr Quantity kMeasurement{"bearing", "rad", "azimuth and elevation"};
  static constexpr std::array kParts{
      Quantity{"azimuth", "rad", "angle from the x axis to the y axis of the sensor"},
      Quantity{"elevation", "rad", "angle above the x-y plane of the sensor"}};
  using DirectionToPoint::DirectionToPoint;

  template <class T>
  bool Predict(const T* position, const T* orientation, const T* lever_arm, const T* mounting,
               const double* point, T* z) const {
    using std::atan2;
    using std::sqrt;
    T h[3];
    InSensor<3>(position, orientation, lever_arm, mounting, point, h);
    const T squared = h[0] * h[0] + h[1] * h[1];
    if (!(squared > T(0.0))) return false;
    z[0] = atan2(h[1], h[0]);
    z[1] = atan2(h[2], T(sqrt(squared)));
    return true;
  }
};

}  // namespace alidade
