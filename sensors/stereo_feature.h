// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/camera.h"
#include "alidade/model/landmark_sensor.h"

namespace alidade {

/// Pixels at which a rectified stereo pair observes a landmark.
///
///   model      u = cx + fx hx/hz,  v = cy + fy hy/hz            h = R_CW (rho (a - r) + m)
///              u_right = u - fx B rho/hz,  v_right = v,    plus noise n ~ N(0, R)
///   Jacobian   automatic differentiation               4 x (6 + landmark), px/m, px/rad, px m
///   noise      R = diag(sigma_u^2, sigma_v^2, sigma_u^2, sigma_v^2)   4x4, px^2
///   inverse    the point at depth fx B / d on the ray of (u, (v + v_right)/2),  d = u - u_right
///
///   symbol     shape  unit    frame  meaning
///   u, v       2      px      left   pixel in the left image; u_right, v_right: in the right image
///   r, q       3, 4   m, -    world  position and orientation (world_from_left) of the left camera
///   a, m, rho  -      -       world  landmark p = a + m / rho in the chosen representation
///   fx to cy   1      px      -      intrinsics of both cameras, which have no distortion
///   B          1      m       -      baseline: x of the right camera in the left camera; > 0
///   sigma      2      px      -      standard deviations of u and v, in both images; > 0
///
/// Defined for  hz > 0. Otherwise out_of_domain; outputs unchanged.
/// Valid for    pixels inside the images and d > 0. Other measurements are invalid.
/// Source       [MonoSlam2015] sec. 2.2; stereo [Ekf2017] sec. 1.2.
template <class Representation>
struct StereoFeature : LandmarkSensor<StereoFeature<Representation>, Vec<4>, Representation> {
  static constexpr Quantity kMeasurement{"pixels", "px", "pixels of the landmark in both images",
                                         "u,v,u_right,v_right"};

  Camera camera;
  double baseline_m;
  std::array<double, 2> sigma_px;

  StereoFeature(const Camera& left_camera, double baseline, const std::array<double, 2>& sigma)
      : camera(left_camera), baseline_m(baseline), sigma_px(sigma) {}
  StereoFeature(const Camera& left_camera, double baseline, double sigma)
      : StereoFeature(left_camera, baseline, std::array{sigma, sigma}) {}
  explicit StereoFeature(Params& p)
      : StereoFeature{
            Camera(p), p.Positive("camera.baseline_m", "m", "stereo baseline"),
            p.PerAxis<2>("sigma_px", "px", "standard deviation of u and v: one number, or [u, v]",
                         kPositive)} {
    if (camera.model != CameraModel::kPinhole) {
      p.Fail("camera.model",
             "is not 'pinhole'; expected pinhole, because a rectified stereo pair has no "
             "distortion");
    }
  }

  template <class T>
  bool PredictInCamera(const T* h, const T& rho, T* pixels) const {
    if (!camera.Project(h, pixels)) return false;
    pixels[2] = pixels[0] - camera.fx * baseline_m * rho / h[2];
    pixels[3] = pixels[1];
    return true;
  }
  template <class T>
  void SqrtNoiseInCamera(const T*, const T&, T* L) const {
    L[0] = L[10] = T(sigma_px[0]);
    L[5] = L[15] = T(sigma_px[1]);
  }
  bool Valid(const double* pixels) const {
    return camera.Contains(pixels) && camera.Contains(pixels + 2) && pixels[0] > pixels[2];
  }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* pixels, T* landmark) const {
    using std::sqrt;
    const T disparity = pixels[0] - pixels[2];
    const T mean[2] = {pixels[0], 0.5 * (pixels[1] + pixels[3])};
    T h[3];
    if (!(disparity > T(0.0)) || !camera.Unproject(mean, h)) return false;
    const T length = sqrt(h[0] * h[0] + h[1] * h[1] + 1.0);  // |h|, because h[2] = 1
    const T rho = disparity / (camera.fx * baseline_m * length);
    return PlaceLandmark<Representation>(position, orientation, h, rho, landmark);
  }
};

}  // namespace alidade
