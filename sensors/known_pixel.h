// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"
#include "alidade/model/camera.h"

namespace alidade {

/// Pixel of a known point, seen by a camera on a body: fiducials, surveyed points. The point is a
/// parameter of the sensor, or each measurement contains it.
///
///   model      z = project(B' (R' (a - p) - l)) + n,   n ~ N(0, diag(sigma^2))
///   Jacobian   automatic differentiation               2 x 12
///   noise      R_z = diag(sigma^2), or the covariance of the measurement       2x2, px^2
///
///   symbol     shape  unit    frame  meaning
///   z          2      px      -      pixel (u, v)
///   p, R       3, 4   m, -    world  position and orientation (world_from_body) of the body
///   a          3      m       world  the point, known
///   l, B       3, 4   m, -    body   position and orientation (body_from_cam) of the camera: model
///                                    parameter states, default: constant at the neutral element
///   sigma      1      px      -      standard deviation of u and v; > 0
///
/// Defined for  a point in the domain of the camera. Otherwise out_of_domain; outputs unchanged.
/// Valid for    a pixel inside the image.
/// Source       project: alidade/model/camera.h; [Brown1971].
struct KnownPixel : Sensor<Vec<2>, Vec<3>, UnitQuaternion, Vec<3>, UnitQuaternion> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"}, Body<3>::Attitude(),
      LeverArm<3>(), Body<3>::Mounting()};
  static constexpr Quantity kMeasurement{"pixel", "px", "pixel of the point", "u,v"};
  using Known = Vec<3>;
  static constexpr Quantity kKnown{"point", "m", "position of the point in the world", "x,y,z"};
  static constexpr const char* kFixedKey = "point_m";

  Camera camera;
  std::array<double, 2> sigma_px;

  KnownPixel(const Camera& camera_model, const std::array<double, 2>& sigma)
      : camera(camera_model), sigma_px(sigma) {}
  explicit KnownPixel(Params& p)
      : KnownPixel{Camera(p),
                   p.PerAxis<2>("sigma_px", "px", "standard deviation of u and v", kPositive)} {}

  template <class T>
  bool Predict(const T* position, const T* orientation, const T* lever_arm, const T* mounting,
               const double* point, T* pixel) const {
    T in_cam[3];
    InSensor<3>(position, orientation, lever_arm, mounting, point, in_cam);
    return camera.Project(in_cam, pixel);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, const double*, T* L) const {
    L[0] = T(sigma_px[0]);
    L[3] = T(sigma_px[1]);
  }
  bool Valid(const double*, const double* pixel) const { return camera.Contains(pixel); }
};

}  // namespace alidade
