// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Disparity of one point that a rectified stereo pair observes.
///
///   model      d = f B / Z + n,   n ~ N(0, sigma^2)
///   Jacobian   dd/dZ = -f B / Z^2                      1x1, px/m
///   noise      R = sigma^2                             1x1, px^2
///   inverse    Z = f B / d
///
///   symbol     shape  unit    frame  meaning
///   d          1      px      left   u_left - u_right
///   Z          1      m       left   depth along the optical axis
///   f, B       1      px, m   -      rectified focal length, baseline; > 0
///   sigma      1      px      -      standard deviation of d; > 0
///   r          1      m       left   min_range_m: the smallest valid depth; 0: no limit
///
/// Defined for  Z > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    0 < d <= f B / r. Other measurements are invalid.
/// Source       [Ekf2017] sec. 1.2, h1; r: sec. 4.
struct StereoDisparity : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"depth", "m", "depth along the optical axis"}};
  static constexpr Quantity kMeasurement{"disparity", "px", "u_left - u_right"};
  static constexpr int kInitialises = 0;

  double bf_px_m, sigma_px, max_px;

  StereoDisparity(double focal_px, double baseline_m, double sigma, double min_range_m = 0.0)
      : bf_px_m(focal_px * baseline_m),
        sigma_px(sigma),
        max_px(min_range_m > 0.0 ? bf_px_m / min_range_m
                                 : std::numeric_limits<double>::infinity()) {}
  explicit StereoDisparity(Params& p)
      : StereoDisparity{
            p.Positive("focal_px", "px", "rectified focal length"),
            p.Positive("baseline_m", "m", "stereo baseline"),
            p.Positive("sigma_px", "px", "standard deviation of the disparity"),
            p.NonNegative("min_range_m", "m", "smallest valid depth; 0: no limit", 0.0)} {}

  template <class T>
  bool Predict(const T* depth, T* disparity) const {
    if (!(depth[0] > T(0.0))) return false;
    disparity[0] = bf_px_m / depth[0];
    return true;
  }
  void Jacobian(const double* depth, MatrixRef J_d_depth) const {
    J_d_depth(0, 0) = -bf_px_m / (depth[0] * depth[0]);
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(sigma_px);
  }
  bool Valid(const double* disparity) const { return disparity[0] > 0.0 && disparity[0] <= max_px; }
  template <class T>
  bool Initialise(const T* disparity, T* depth) const {
    if (!(disparity[0] > T(0.0))) return false;
    depth[0] = bf_px_m / disparity[0];
    return true;
  }
};

}  // namespace alidade
