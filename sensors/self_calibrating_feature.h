// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Lens with focal length and radial distortion, as in Bundler and in the BAL problems.
///
///   z = f s(q) (x, y),   s(q) = 1 + k1 q + k2 q^2,   q = x^2 + y^2
struct RadialLens {
  static constexpr Quantity kIntrinsics{"intrinsics", "", "focal length in px, distortion",
                                        "focal_px,k1,k2"};
  static constexpr int kSize = 3;

  /// Computes z of the ray (x, y, 1) for the intrinsics k = (f, k1, k2).
  template <class T>
  static void Project(const T* k, const T& x, const T& y, T* z) {
    const T q = x * x + y * y;
    const T scale = k[0] * (1.0 + q * (k[1] + q * k[2]));
    z[0] = scale * x;
    z[1] = scale * y;
  }
  /// Computes the Jacobians of Project: J_z_x = dz/d(x, y), 2x2 row-major, and J_z_k = dz/dk.
  static void Jacobian(const double* k, double x, double y, double* J_z_x, MatrixRef J_z_k) {
    const double q = x * x + y * y, s = 1.0 + q * (k[1] + q * k[2]);
    const double slope = 2.0 * k[0] * (k[1] + 2.0 * q * k[2]);
    J_z_x[0] = k[0] * s + slope * x * x;
    J_z_x[1] = J_z_x[2] = slope * x * y;
    J_z_x[3] = k[0] * s + slope * y * y;
    const double ray[2] = {x, y};
    for (int i = 0; i < 2; ++i) {
      J_z_k(i, 0) = s * ray[i];
      J_z_k(i, 1) = k[0] * q * ray[i];
      J_z_k(i, 2) = k[0] * q * q * ray[i];
    }
  }
};

/// Lens with focal length, principal point, radial and tangential distortion. The model is `radtan`
/// of alidade/model/camera.h with square pixels.
///
///   z = c + f (x s(q) + 2 p1 x y + p2 (q + 2 x^2),  y s(q) + p1 (q + 2 y^2) + 2 p2 x y)
///   s(q) = 1 + k1 q + k2 q^2 + k3 q^3,   q = x^2 + y^2
struct RadtanLens {
  static constexpr Quantity kIntrinsics{"intrinsics", "",
                                        "focal length and principal point in px, distortion",
                                        "focal_px,cx,cy,k1,k2,k3,p1,p2"};
  static constexpr int kSize = 8;

  /// Computes z of the ray (x, y, 1) for the intrinsics k = (f, cx, cy, k1, k2, k3, p1, p2).
  template <class T>
  static void Project(const T* k, const T& x, const T& y, T* z) {
    T distorted[2];
    Distort(k, x, y, distorted);
    z[0] = k[1] + k[0] * distorted[0];
    z[1] = k[2] + k[0] * distorted[1];
  }
  /// Computes the Jacobians of Project: J_z_x = dz/d(x, y), 2x2 row-major, and J_z_k = dz/dk.
  static void Jacobian(const double* k, double x, double y, double* J_z_x, MatrixRef J_z_k) {
    const double f = k[0], q = x * x + y * y, p1 = k[6], p2 = k[7];
    const double s = 1.0 + q * (k[3] + q * (k[4] + q * k[5]));
    const double slope = 2.0 * (k[3] + q * (2.0 * k[4] + q * 3.0 * k[5]));
    J_z_x[0] = f * (s + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x);
    J_z_x[1] = J_z_x[2] = f * (slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y);
    J_z_x[3] = f * (s + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x);
    const double ray[2] = {x, y};
    double distorted[2];
    Distort(k, x, y, distorted);
    for (int i = 0; i < 2; ++i) {
      J_z_k(i, 0) = distorted[i];
      J_z_k(i, 1 + i) = 1.0;
      for (int power = 0; power < 3; ++power) {
        J_z_k(i, 3 + power) = f * ray[i] * (power == 0 ? q : power == 1 ? q * q : q * q * q);
      }
      J_z_k(i, 6 + i) = f * 2.0 * x * y;
      J_z_k(i, 7 - i) = f * (q + 2.0 * ray[i] * ray[i]);
    }
  }

 private:
  template <class T>
  static void Distort(const T* k, const T& x, const T& y, T* distorted) {
    const T q = x * x + y * y, xy = 2.0 * x * y;
    const T s = 1.0 + q * (k[3] + q * (k[4] + q * k[5]));
    distorted[0] = x * s + k[6] * xy + k[7] * (q + 2.0 * x * x);
    distorted[1] = y * s + k[6] * (q + 2.0 * y * y) + k[7] * xy;
  }
};

/// Lens with two focal lengths, as in the camera models OPENCV and PINHOLE of COLMAP. The
/// distortion is that of RadtanLens without k3.
///
///   z = c + (fx x', fy y'),   (x', y') = the distorted (x, y) of RadtanLens
struct OpenCvLens {
  static constexpr Quantity kIntrinsics{"intrinsics", "",
                                        "focal lengths and principal point in px, distortion",
                                        "fx,fy,cx,cy,k1,k2,p1,p2"};
  static constexpr int kSize = 8;

  /// Computes z of the ray (x, y, 1) for the intrinsics k = (fx, fy, cx, cy, k1, k2, p1, p2).
  template <class T>
  static void Project(const T* k, const T& x, const T& y, T* z) {
    const T unit[8] = {T(1.0), T(0.0), T(0.0), k[4], k[5], T(0.0), k[6], k[7]};
    RadtanLens::Project(unit, x, y, z);
    for (int i = 0; i < 2; ++i) z[i] = k[2 + i] + k[i] * z[i];
  }
  /// Computes the Jacobians of Project: J_z_x = dz/d(x, y), 2x2 row-major, and J_z_k = dz/dk.
  static void Jacobian(const double* k, double x, double y, double* J_z_x, MatrixRef J_z_k) {
    const double unit[8] = {1.0, 0.0, 0.0, k[4], k[5], 0.0, k[6], k[7]};
    double distorted[2], j[16] = {};
    RadtanLens::Project(unit, x, y, distorted);
    RadtanLens::Jacobian(unit, x, y, J_z_x, MatrixRef{j, 8});
    constexpr int kDistortion[4] = {3, 4, 6, 7};  // k1, k2, p1, p2 in the intrinsics of RadtanLens
    for (int i = 0; i < 2; ++i) {
      for (int c = 0; c < 2; ++c) J_z_x[2 * i + c] *= k[i];
      J_z_k(i, i) = distorted[i];
      J_z_k(i, 2 + i) = 1.0;
      for (int c = 0; c < 4; ++c) J_z_k(i, 4 + c) = k[i] * j[8 * i + kDistortion[c]];
    }
  }
};

/// Pixel at which a camera observes a point. The intrinsics of the camera are also estimated.
///
///   model      (u, v) = K(k; hx/hz, hy/hz) + n,   n ~ N(0, R),   h = R_CW (p - r)
///   Jacobian   A = dz/dh:  dz/dr = -A R_CW,  dz/dq = A [h]x,  dz/dp = A R_CW,  dz/dk    2 x n
///   noise      R = diag(sigma_u^2, sigma_v^2)          2x2, px^2
///
///   symbol     shape  unit    frame  meaning
///   u, v       2      px      -      the pixel, relative to the origin of the lens model
///   r, q       3, 4   m, -    world  position and orientation (world_from_cam) of the camera
///   k          3, 8   px, -   -      intrinsics of the lens
///   p          3      m       world  the point
///   sigma      2      px      -      standard deviations of u and v; > 0
///
/// Defined for  hz > 0, or hz != 0 if the domain is projective. Otherwise out_of_domain; outputs
///              unchanged. In BAL and Bundler problems, the depth may have either sign.
/// Source       [Agarwal2010], [Brown1971].
template <class Lens>
struct SelfCalibratingFeature : Sensor<Vec<2>, Vec<3>, UnitQuaternion, Vec<Lens::kSize>, Vec<3>> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the camera in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the camera, world_from_cam", "w,x,y,z"},
      Lens::kIntrinsics, Quantity{"point", "m", "position of the point in the world", "x,y,z"}};
  static constexpr Quantity kMeasurement{"pixel", "px", "pixel of the point", "u,v"};

  std::array<double, 2> sigma_px;
  bool is_projective;  ///< true if points behind the camera are also visible

  explicit SelfCalibratingFeature(const std::array<double, 2>& sigma, bool projective = false)
      : sigma_px(sigma), is_projective(projective) {}
  explicit SelfCalibratingFeature(double sigma, bool projective = false)
      : SelfCalibratingFeature(std::array{sigma, sigma}, projective) {}
  explicit SelfCalibratingFeature(Params& p)
      : SelfCalibratingFeature{
            p.PerAxis<2>("sigma_px", "px", "standard deviation of u and v: one number, or [u, v]",
                         kPositive),
            p.Choice("domain", {"in_front", "projective"},
                     "visible points: points in front of the camera, or all points", 0) == 1} {}

  template <class T>
  bool Predict(const T* position, const T* orientation, const T* intrinsics, const T* point,
               T* pixel) const {
    T h[3];
    InCamera(position, orientation, point, h);
    if (!(h[2] > T(0.0) || (is_projective && h[2] < T(0.0)))) return false;
    Lens::Project(intrinsics, T(h[0] / h[2]), T(h[1] / h[2]), pixel);
    return true;
  }
  void Jacobian(const double* position, const double* orientation, const double* intrinsics,
                const double* point, MatrixRef J_z_r, MatrixRef J_z_q, MatrixRef J_z_k,
                MatrixRef J_z_p) const {
    double h[3], J_z_x[4];
    InCamera(position, orientation, point, h);
    const double inverse_depth = 1.0 / h[2], x = h[0] * inverse_depth, y = h[1] * inverse_depth;
    Lens::Jacobian(intrinsics, x, y, J_z_x, J_z_k);
    for (int i = 0; i < 2; ++i) {
      const double ax = J_z_x[2 * i] * inverse_depth, ay = J_z_x[2 * i + 1] * inverse_depth;
      const double a[3] = {ax, ay, -(ax * x + ay * y)};  // one row of dz/dh
      double in_world[3];
      UnitQuaternion::Rotate(orientation, a, in_world);
      for (int c = 0; c < 3; ++c) {
        J_z_p(i, c) = in_world[c];
        J_z_r(i, c) = -in_world[c];
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        J_z_q(i, c) = a[d] * h[e] - a[e] * h[d];
      }
    }
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* l) const {
    l[0] = T(sigma_px[0]);
    l[3] = T(sigma_px[1]);
  }

 private:
  template <class T>
  static void InCamera(const T* position, const T* orientation, const T* point, T* h) {
    const T offset[3] = {point[0] - position[0], point[1] - position[1], point[2] - position[2]};
    UnitQuaternion::RotateBack(orientation, offset, h);
  }
};

}  // namespace alidade
