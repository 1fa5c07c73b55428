// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Inverse of the apparent size of a target, relative to a template that was recorded at depth Z0.
///
///   model      s = lambda Z + n,   n ~ N(0, sigma_s^2),   lambda = 1 / Z0,  s = 1 / scale
///   Jacobian   ds/dZ = lambda, ds/dlambda = Z          1x1, 1/m and m
///   noise      propagated: sigma_s = (2 sigma / w) (lambda Z)^3      derived below
///              constant:   sigma_s = sigma_inverse_scale
///   inverse    lambda = s / Z
///
///   symbol     shape  unit    frame  meaning
///   s          1      -       cam    template size / apparent size
///   Z          1      m       cam    depth along the optical axis
///   lambda     1      1/m     -      inverse depth at which the template was recorded
///   w, sigma   1      px      -      template width, standard deviation of an edge; > 0
///
/// A target of apparent width w' = w / s has the scale w'/w. [Ekf2017] sets the standard deviation
/// of the scale to 2 sigma / w', because it adds the errors of the two edges linearly, not in
/// quadrature. The standard deviation of s = 1 / scale is then s^2 2 sigma / w'.
///
/// Defined for  Z > 0 and lambda > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    s > 0. Other measurements are invalid.
/// Source       [Ekf2017] sec. 1.2, h2; noise sec. 4.
struct Scale2d : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{
      Quantity{"depth", "m", "depth along the optical axis"},
      Quantity{"inverse_distance", "1/m", "inverse depth at which the template was recorded"}};
  static constexpr Quantity kMeasurement{"inverse_scale", "", "template size / apparent size"};
  static constexpr int kInitialises = 1;

  double constant_sigma = 0.0;  ///< sigma_inverse_scale if the noise is constant; else 0
  double relative_sigma = 0.0;  ///< 2 sigma / w if the noise is propagated; else 0

  static Scale2d FromPixels(double template_px, double sigma_px) {
    return Scale2d(0.0, 2.0 * sigma_px / template_px);
  }
  static Scale2d FromSigma(double sigma) { return Scale2d(sigma, 0.0); }
  explicit Scale2d(Params& p)
      : Scale2d(
            p.Choice("noise_model", {"propagated", "constant"}, "noise model of 1/scale", 0) == 1
                ? FromSigma(p.Positive("sigma_inverse_scale", "", "standard deviation of 1/scale"))
                : FromPixels(p.Positive("template_px", "px", "width of the template"),
                             p.Positive("sigma_px", "px", "standard deviation of an edge"))) {}

  template <class T>
  bool Predict(const T* depth, const T* inverse_distance, T* inverse_scale) const {
    if (!(depth[0] > T(0.0)) || !(inverse_distance[0] > T(0.0))) return false;
    inverse_scale[0] = inverse_distance[0] * depth[0];
    return true;
  }
  void Jacobian(const double* depth, const double* inverse_distance, MatrixRef J_s_depth,
                MatrixRef J_s_inverse_distance) const {
    J_s_depth(0, 0) = inverse_distance[0];
    J_s_inverse_distance(0, 0) = depth[0];
  }
  template <class T>
  void SqrtNoise(const T* depth, const T* inverse_distance, T* l) const {
    const T s = inverse_distance[0] * depth[0];
    l[0] = constant_sigma > 0.0 ? T(constant_sigma) : relative_sigma * s * s * s;
  }
  bool Valid(const double* inverse_scale) const { return inverse_scale[0] > 0.0; }
  template <class T>
  bool Initialise(const T* depth, const T* inverse_scale, T* inverse_distance) const {
    if (!(depth[0] > T(0.0))) return false;
    inverse_distance[0] = inverse_scale[0] / depth[0];
    return true;
  }

 private:
  Scale2d(double constant, double relative) : constant_sigma(constant), relative_sigma(relative) {}
};

}  // namespace alidade
