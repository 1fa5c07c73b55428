// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"
#include "alidade/model/landmark_sensor.h"

namespace alidade {

/// Noise and validity of a range and a bearing with D - 1 angles, in D dimensions.
template <int D>
struct RangeBearingLimits {
  double sigma_range_m, sigma_bearing_rad, max_range_m;

  RangeBearingLimits(double range_m, double bearing_rad,
                     double largest_range_m = std::numeric_limits<double>::infinity())
      : sigma_range_m(range_m), sigma_bearing_rad(bearing_rad), max_range_m(largest_range_m) {}
  explicit RangeBearingLimits(Params& p)
      : RangeBearingLimits{
            p.Positive("sigma_range_m", "m", "standard deviation of the range"),
            p.Positive("sigma_bearing_rad", "rad",
                       D == 2 ? "standard deviation of the bearing"
                              : "standard deviation of the bearing, for each of its two axes"),
            p.NumberOrNone("max_range_m", "m", "largest valid range", kPositive)
                .value_or(std::numeric_limits<double>::infinity())} {}

  /// Writes L, D x D.
  template <class T>
  void WriteSqrtNoise(T* L) const {
    L[0] = T(sigma_range_m);
    for (int i = 1; i < D; ++i) L[(D + 1) * i] = T(sigma_bearing_rad);
  }
  bool IsValid(const double* z) const { return z[0] > 0.0 && z[0] <= max_range_m; }
};

/// Computes the range and the bearing of a point h in the frame of the sensor: an angle in the
/// plane, a unit vector in space. Returns false for h = 0.
template <int D, class T>
bool ComputeRangeBearing(const T* h, T* z) {
  using std::atan2;
  using std::sqrt;
  T squared(0.0);
  for (int i = 0; i < D; ++i) squared += h[i] * h[i];
  if (!(squared > T(0.0))) return false;
  z[0] = sqrt(squared);
  if constexpr (D == 2) {
    z[1] = atan2(h[1], h[0]);
  } else {
    for (int i = 0; i < 3; ++i) z[1 + i] = h[i] / z[0];
  }
  return true;
}

/// Range and bearing of a landmark, measured by a laser, radar or sonar.
///
///   model      d = |h| / rho + n_d,   b = h / |h| (+) n_b,      h = R_CW (rho (a - r) + m)
///   Jacobian   automatic differentiation               3 x (6 + landmark)
///   noise      R = diag(sigma_d^2, sigma_b^2, sigma_b^2)        3x3, m^2 and rad^2
///   inverse    the point at the distance d in the direction of the bearing
///
///   symbol     shape  unit    frame  meaning
///   d          1      m       -      range, the distance from the sensor
///   b          3      -       sensor bearing, a unit vector
///   n_b        2      rad     -      noise in the tangent plane of b
///   r, q       3, 4   m, -    world  position and orientation (world_from_sensor) of the sensor
///   a, m, rho  -      -       world  landmark p = a + m / rho in the chosen representation
///   sigma_d, sigma_b  1  m, rad  -   standard deviations; > 0
///   d_max      1      m       -      max_range_m: the largest valid range; > 0
///
/// Defined for  rho > 0 and |h| > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    0 < d <= d_max. Other measurements are invalid.
/// Source       [Thrun2005] sec. 6.6; here the bearing is a unit vector instead of an angle.
template <class Representation>
struct RangeBearing
    : LandmarkSensor<RangeBearing<Representation>, Product<Vec<1>, UnitVector>, Representation>,
      RangeBearingLimits<3> {
  static constexpr Quantity kMeasurement{"range_and_bearing", "", "range and bearing"};
  static constexpr std::array kParts{
      Quantity{"range", "m", "distance from the sensor"},
      Quantity{"bearing", "", "direction in the frame of the sensor", "x,y,z"}};

  using RangeBearingLimits::RangeBearingLimits;

  template <class T>
  bool PredictInCamera(const T* h, const T& rho, T* z) const {
    if (!(rho > T(0.0)) || !ComputeRangeBearing<3>(h, z)) return false;
    z[0] /= rho;
    return true;
  }
  template <class T>
  void SqrtNoiseInCamera(const T*, const T&, T* L) const {
    WriteSqrtNoise(L);
  }
  bool Valid(const double* z) const { return IsValid(z); }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* z, T* landmark) const {
    if (!(z[0] > T(0.0))) return false;
    return PlaceLandmark<Representation>(position, orientation, z + 1, T(1.0 / z[0]), landmark);
  }
};

/// Range and bearing of a landmark in the plane.
///
///   model      d = |h| + n_d,   b = atan2(h_y, h_x) (+) n_b,   h = R' (m - p)
///   Jacobian   automatic differentiation               2 x 5
///   noise      R_z = diag(sigma_d^2, sigma_b^2)        2x2, m^2 and rad^2
///   inverse    m = p + d R (cos b, sin b)
///
///   symbol     shape  unit    frame  meaning
///   d, b       1      m, rad  body   range and bearing, counter-clockwise from the x axis
///   p, R       2, 1   m, rad  world  position and heading of the body
///   m          2      m       world  landmark
///   sigma_d, sigma_b  1  m, rad  -   standard deviations; > 0
///   d_max      1      m       -      max_range_m: the largest valid range; > 0
///
/// Defined for  h != 0; the inverse for d > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    0 < d <= d_max. Other measurements are invalid.
/// Source       [Thrun2005] sec. 6.6.
struct PlanarRangeBearing : Sensor<Product<Vec<1>, Angle>, Vec<2>, Angle, Vec<2>>,
                            RangeBearingLimits<2> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", "x,y"}, Body<2>::Attitude(),
      Quantity{"landmark", "m", "position of the landmark in the world", "x,y",
               ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"range_and_bearing", "", "range and bearing in the plane"};
  static constexpr std::array kParts{
      Quantity{"range", "m", "distance from the body"},
      Quantity{"bearing", "rad", "bearing, counter-clockwise from the x axis of the body"}};
  static constexpr int kInitialises = 2;
  using RangeBearingLimits::RangeBearingLimits;

  template <class T>
  bool Predict(const T* position, const T* heading, const T* landmark, T* z) const {
    const T difference[2] = {landmark[0] - position[0], landmark[1] - position[1]};
    T h[2];
    Body<2>::RotateBack(heading, difference, h);
    return ComputeRangeBearing<2>(h, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    WriteSqrtNoise(L);
  }
  bool Valid(const double* z) const { return IsValid(z); }
  template <class T>
  bool Initialise(const T* position, const T* heading, const T* z, T* landmark) const {
    using std::cos;
    using std::sin;
    if (!(z[0] > T(0.0))) return false;
    const T h[2] = {z[0] * cos(z[1]), z[0] * sin(z[1])};
    Body<2>::Rotate(heading, h, landmark);
    for (int i = 0; i < 2; ++i) landmark[i] += position[i];
    return true;
  }
};

/// Range and bearing of a known point, in the plane (D = 2) or in space (D = 3). The point is a
/// parameter of the sensor, or each measurement contains it.
///
///   model      d = |h| + n_d,   b = u(h) (+) n_b,      h = B' (R' (a - p) - l)
///              u(h) = atan2(h_y, h_x) in the plane, h / |h| in space
///   Jacobian   automatic differentiation               2 x 6, 3 x 12
///   noise      R_z = diag(sigma_d^2, sigma_b^2 I)      2x2, 3x3, m^2 and rad^2
///
///   symbol     shape  unit    frame  meaning
///   d          1      m       -      range, the distance from the sensor
///   b          1, 3   rad, -  sensor bearing, an angle or a unit vector
///   p          2, 3   m       world  position of the body
///   R          -      rad, -  -      attitude, world_from_body: a heading in the plane,
///                                    an orientation in space
///   a          2, 3   m       world  the point, known
///   l, B       -      m, -    body   lever arm and mounting (body_from_sensor): model
///                                    parameter states, default: constant at the neutral element
///   sigma_d, sigma_b  1  m, rad  -   standard deviations, of each angle; > 0
///   d_max      1      m       -      max_range_m: the largest valid range; > 0
///
/// Defined for  h != 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    0 < d <= d_max. Other measurements are invalid.
/// Source       [Thrun2005] sec. 6.6.
template <int D>
struct RangeBearingToPoint
    : Sensor<Product<Vec<1>, std::conditional_t<D == 2, Angle, UnitVector>>, Vec<D>,
             typename Body<D>::Rotation, Vec<D>, typename Body<D>::Rotation>,
      RangeBearingLimits<D> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", kAxes<D>}, Body<D>::Attitude(),
      LeverArm<D>(), Body<D>::Mounting()};
  static constexpr Quantity kMeasurement{"range_and_bearing", "", "range and bearing of the point"};
  static constexpr std::array kParts{
      Quantity{"range", "m", "distance from the sensor"},
      D == 2 ? Quantity{"bearing", "rad", "bearing, counter-clockwise from the x axis"}
             : Quantity{"bearing", "", "direction in the frame of the sensor", "x,y,z"}};
  using Known = Vec<D>;
  static constexpr Quantity kKnown{"point", "m", "position of the point in the world", kAxes<D>};
  static constexpr const char* kFixedKey = "point_m";
  using RangeBearingLimits<D>::RangeBearingLimits;

  template <class T>
  bool Predict(const T* position, const T* attitude, const T* lever_arm, const T* mounting,
               const double* point, T* z) const {
    T h[D];
    InSensor<D>(position, attitude, lever_arm, mounting, point, h);
    return ComputeRangeBearing<D>(h, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, const double*, T* L) const {
    this->WriteSqrtNoise(L);
  }
  bool Valid(const double*, const double* z) const { return this->IsValid(z); }
};

}  // namespace alidade
