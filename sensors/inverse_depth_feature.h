// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/camera.h"
#include "alidade/model/landmark_sensor.h"

namespace alidade {

/// Pixel at which one camera observes a landmark.
///
///   model      (u, v) = K(h) + n,   n ~ N(0, R),   h = R_CW (rho (a - r) + m)
///   Jacobian   automatic differentiation               2 x (6 + landmark), px/m, px/rad, px m
///   noise      R = diag(sigma_u^2, sigma_v^2)          2x2, px^2
///   inverse    the point on the ray of the pixel, at the inverse distance rho0 of the prior
///
///   symbol     shape  unit    frame  meaning
///   u, v       2      px      -      the pixel
///   r, q       3, 4   m, -    world  position and orientation (world_from_cam) of the camera
///   a, m, rho  -      -       world  landmark p = a + m / rho in the chosen representation
///   K          -      -       cam    projection with distortion, see alidade/model/camera.h
///   sigma      2      px      -      standard deviations of u and v; > 0
///   rho0       1      1/m     -      prior inverse distance from the camera; > 0 for xyz landmarks
///
/// Defined for  h in the domain of K. Otherwise out_of_domain; outputs unchanged. rho <= 0 is
///              allowed, because only the direction of h matters.
/// Valid for    pixels inside the image. Other measurements are invalid.
/// Source       [MonoSlam2015] sec. 4.3, [Civera2008] sec. II.
template <class Representation>
struct InverseDepthFeature
    : LandmarkSensor<InverseDepthFeature<Representation>, Vec<2>, Representation> {
  static constexpr Quantity kMeasurement{"pixel", "px", "pixel of the landmark", "u,v"};
  static constexpr int kPrior = 1;

  Camera camera;
  std::array<double, 2> sigma_px;

  InverseDepthFeature(const Camera& camera_model, const std::array<double, 2>& sigma)
      : camera(camera_model), sigma_px(sigma) {}
  InverseDepthFeature(const Camera& camera_model, double sigma)
      : InverseDepthFeature(camera_model, std::array{sigma, sigma}) {}
  explicit InverseDepthFeature(Params& p)
      : InverseDepthFeature{
            Camera(p),
            p.PerAxis<2>("sigma_px", "px", "standard deviation of u and v: one number, or [u, v]",
                         kPositive)} {}

  template <class T>
  bool PredictInCamera(const T* h, const T&, T* pixel) const {
    return camera.Project(h, pixel);
  }
  template <class T>
  void SqrtNoiseInCamera(const T*, const T&, T* L) const {
    L[0] = T(sigma_px[0]);
    L[3] = T(sigma_px[1]);
  }
  bool Valid(const double* pixel) const { return camera.Contains(pixel); }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* pixel, const T* prior,
                  T* landmark) const {
    T h[3];
    return camera.Unproject(pixel, h) &&
           PlaceLandmark<Representation>(position, orientation, h, prior[0], landmark);
  }
};

}  // namespace alidade
