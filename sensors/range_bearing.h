// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"
#include "alidade/model/landmark_sensor.h"

namespace alidade {

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
    : LandmarkSensor<RangeBearing<Representation>, Product<Vec<1>, UnitVector>, Representation> {
  static constexpr Quantity kMeasurement{"range_and_bearing", "",
                                         "range and bearing of the landmark"};
  static constexpr std::array kParts{
      Quantity{"range", "m", "distance of the landmark from the sensor"},
      Quantity{"bearing", "", "direction of the landmark in the frame of the sensor", "x,y,z"}};

  double sigma_range_m, sigma_bearing_rad, max_range_m;

  RangeBearing(double range_m, double bearing_rad,
               double largest_range_m = std::numeric_limits<double>::infinity())
      : sigma_range_m(range_m), sigma_bearing_rad(bearing_rad), max_range_m(largest_range_m) {}
  explicit RangeBearing(Params& p)
      : RangeBearing(p.Positive("sigma_range_m", "m", "standard deviation of the range"),
                     p.Positive("sigma_bearing_rad", "rad",
                                "standard deviation of the bearing, for each of its two axes"),
                     p.NumberOrNone("max_range_m", "m", "largest valid range", kPositive)
                         .value_or(std::numeric_limits<double>::infinity())) {}

  template <class T>
  bool PredictInCamera(const T* h, const T& rho, T* z) const {
    using std::sqrt;
    const T squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
    if (!(rho > T(0.0)) || !(squared > T(0.0))) return false;
    const T length = sqrt(squared);
    z[0] = length / rho;
    for (int i = 0; i < 3; ++i) z[1 + i] = h[i] / length;
    return true;
  }
  template <class T>
  void SqrtNoiseInCamera(const T*, const T&, T* L) const {
    L[0] = T(sigma_range_m);
    L[4] = L[8] = T(sigma_bearing_rad);
  }
  bool Valid(const double* z) const { return z[0] > 0.0 && z[0] <= max_range_m; }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* z, T* landmark) const {
    if (!(z[0] > T(0.0))) return false;
    return PlaceLandmark<Representation>(position, orientation, z + 1, T(1.0 / z[0]), landmark);
  }
};

/// Range and bearing in the plane, of a landmark or of a known point.
///
///   model      d = |h| + n_d,   b = atan2(h_y, h_x) (+) n_b,   h = R' (m - p)
///   Jacobian   automatic differentiation               2 x 3, and 2 x 2 of a landmark
///   noise      R_z = diag(sigma_d^2, sigma_b^2)        2x2, m^2 and rad^2
///   inverse    m = p + d R (cos b, sin b)              of a landmark
///
///   symbol     shape  unit    frame  meaning
///   d, b       1      m, rad  body   range and bearing, counter-clockwise from the x axis
///   p, R       2, 1   m, rad  world  position and heading of the body
///   m          2      m       world  landmark, or known point
///   sigma_d, sigma_b  1  m, rad  -   standard deviations; > 0
///   d_max      1      m       -      max_range_m: the largest valid range; > 0
///
/// Defined for  h != 0; the inverse for d > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    0 < d <= d_max. Other measurements are invalid.
/// Source       [Thrun2005] sec. 6.6.
struct PlanarRangeBearing {
  static constexpr Quantity kMeasurement{"range_and_bearing", "", "range and bearing in the plane"};
  static constexpr std::array kParts{
      Quantity{"range", "m", "distance from the body"},
      Quantity{"bearing", "rad", "bearing, counter-clockwise from the x axis of the body"}};
  static constexpr Quantity kPosition{"position", "m", "position of the body in the world", "x,y"};

  double sigma_range_m, sigma_bearing_rad, max_range_m;

  PlanarRangeBearing(double range_m, double bearing_rad,
                     double largest_range_m = std::numeric_limits<double>::infinity())
      : sigma_range_m(range_m), sigma_bearing_rad(bearing_rad), max_range_m(largest_range_m) {}
  explicit PlanarRangeBearing(Params& p)
      : PlanarRangeBearing(
            p.Positive("sigma_range_m", "m", "standard deviation of the range"),
            p.Positive("sigma_bearing_rad", "rad", "standard deviation of the bearing"),
            p.NumberOrNone("max_range_m", "m", "largest valid range", kPositive)
                .value_or(std::numeric_limits<double>::infinity())) {}

  /// Computes z of the point m.
  template <class T, class Point>
  static bool ComputeRangeAndBearing(const T* position, const T* heading, const Point* point,
                                     T* z) {
    using std::atan2;
    using std::sqrt;
    const T difference[2] = {point[0] - position[0], point[1] - position[1]};
    const T squared = difference[0] * difference[0] + difference[1] * difference[1];
    if (!(squared > T(0.0))) return false;
    T h[2];
    Body<2>::RotateBack(heading, difference, h);
    z[0] = sqrt(squared);
    z[1] = atan2(h[1], h[0]);
    return true;
  }
  template <class T>
  void WriteNoise(T* L) const {
    L[0] = T(sigma_range_m);
    L[3] = T(sigma_bearing_rad);
  }
  bool IsValid(const double* z) const { return z[0] > 0.0 && z[0] <= max_range_m; }
};

/// PlanarRangeBearing of a landmark.
struct PlanarRangeBearingOfLandmark : Sensor<Product<Vec<1>, Angle>, Vec<2>, Angle, Vec<2>>,
                                      PlanarRangeBearing {
  static constexpr std::array kRoles{
      kPosition, Body<2>::Attitude(),
      Quantity{"landmark", "m", "position of the landmark in the world", "x,y",
               ALIDADE_ROLE_LANDMARK}};
  static constexpr int kInitialises = 2;
  using PlanarRangeBearing::PlanarRangeBearing;

  template <class T>
  bool Predict(const T* position, const T* heading, const T* landmark, T* z) const {
    return ComputeRangeAndBearing(position, heading, landmark, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    WriteNoise(L);
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

/// PlanarRangeBearing of a known point, which is a parameter or accompanies each measurement.
struct PlanarRangeBearingOfPoint : Sensor<Product<Vec<1>, Angle>, Vec<2>, Angle>,
                                   PlanarRangeBearing {
  static constexpr std::array kRoles{kPosition, Body<2>::Attitude()};
  using Known = Vec<2>;
  static constexpr Quantity kKnown{"point", "m", "position of the point in the world", "x,y"};
  static constexpr const char* kFixedKey = "point_m";
  using PlanarRangeBearing::PlanarRangeBearing;

  template <class T>
  bool Predict(const T* position, const T* heading, const double* point, T* z) const {
    return ComputeRangeAndBearing(position, heading, point, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const double*, T* L) const {
    WriteNoise(L);
  }
  bool Valid(const double*, const double* z) const { return IsValid(z); }
};

}  // namespace alidade
