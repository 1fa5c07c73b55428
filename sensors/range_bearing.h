// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace alidade
