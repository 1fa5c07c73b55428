// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/camera.h"
#include "alidade/model/landmark_sensor.h"

namespace alidade {

/// Pixel and depth at which a depth camera observes a landmark.
///
///   model      (u, v) = K(h) + n_px,  d = hz / rho + n_d,     h = R_CW (rho (a - r) + m)
///   Jacobian   automatic differentiation               3 x (6 + landmark)
///   noise      R = diag(sigma_u^2, sigma_v^2, (s0 + s2 d^2)^2)  3x3, px^2 and m^2, predicted d
///   inverse    the point at the depth d on the ray of the pixel
///
///   symbol     shape  unit    frame  meaning
///   u, v       2      px      -      the pixel
///   d          1      m       cam    depth along the optical axis
///   r, q       3, 4   m, -    world  position and orientation (world_from_cam) of the camera
///   a, m, rho  -      -       world  landmark p = a + m / rho in the chosen representation
///   K          -      -       cam    projection with distortion, see alidade/model/camera.h
///   sigma      2      px      -      standard deviations of u and v; > 0
///   s0, s2     1      m, 1/m  -      constant part, > 0, and coefficient of d^2, >= 0, of the
///                                    standard deviation of d. s2 models a depth from disparity
///
/// Defined for  h in the domain of K, hz > 0, rho > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    pixels inside the image and d > 0. Other measurements are invalid.
/// Source       [MonoSlam2015] sec. 2.1; noise [Khoshelham2012].
template <class Representation>
struct DepthFeature : LandmarkSensor<DepthFeature<Representation>, Vec<3>, Representation> {
  static constexpr Quantity kMeasurement{"pixel_and_depth", "",
                                         "pixel and depth of the landmark, px and m", "u,v,depth"};

  Camera camera;
  std::array<double, 2> sigma_px;
  double sigma_depth_m, sigma_depth_quadratic_1_m;

  DepthFeature(const Camera& depth_camera, const std::array<double, 2>& sigma, double depth_m,
               double depth_quadratic_1_m = 0.0)
      : camera(depth_camera),
        sigma_px(sigma),
        sigma_depth_m(depth_m),
        sigma_depth_quadratic_1_m(depth_quadratic_1_m) {}
  DepthFeature(const Camera& depth_camera, double sigma, double depth_m,
               double depth_quadratic_1_m = 0.0)
      : DepthFeature(depth_camera, std::array{sigma, sigma}, depth_m, depth_quadratic_1_m) {}
  explicit DepthFeature(Params& p)
      : DepthFeature{
            Camera(p),
            p.PerAxis<2>("sigma_px", "px", "standard deviation of u and v: one number, or [u, v]",
                         kPositive),
            p.Positive("sigma_depth_m", "m", "standard deviation of the depth, constant part"),
            p.NonNegative("sigma_depth_quadratic_1_m", "1/m",
                          "standard deviation of the depth, coefficient of depth^2", 0.0)} {}

  template <class T>
  bool PredictInCamera(const T* h, const T& rho, T* z) const {
    if (!(h[2] > T(0.0)) || !(rho > T(0.0)) || !camera.Project(h, z)) return false;
    z[2] = h[2] / rho;
    return true;
  }
  template <class T>
  void SqrtNoiseInCamera(const T* h, const T& rho, T* L) const {
    const T depth = h[2] / rho;
    L[0] = T(sigma_px[0]);
    L[4] = T(sigma_px[1]);
    L[8] = sigma_depth_m + sigma_depth_quadratic_1_m * depth * depth;
  }
  bool Valid(const double* z) const { return camera.Contains(z) && z[2] > 0.0; }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* z, T* landmark) const {
    using std::sqrt;
    T h[3];
    if (!(z[2] > T(0.0)) || !camera.Unproject(z, h) || !(h[2] > T(0.0))) return false;
    const T length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    return PlaceLandmark<Representation>(position, orientation, h, T(h[2] / (z[2] * length)),
                                         landmark);
  }
};

}  // namespace alidade
