// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "alidade/model/params.h"
#include "alidade/model/radial_polynomial.h"

/// Camera models, which map rays to pixels and pixels to rays. The scalar type is a template
/// parameter: double or a dual number. The derivatives are also exact if a function solves an
/// equation by iteration.
namespace alidade {

/// Projection and lens distortion. All models except kPinhole have radial coefficients k.
enum class CameraModel { kPinhole, kRadtan, kEquidistant, kPhotogrammetric, kRationalPolynomial };

/// Camera with projection, lens distortion and image size.
///
///   pixel             u = cx + fx x,  v = cy + fy y          the model computes (x, y) from h
///   pinhole           (x, y) = (hx, hy) / hz =: (x0, y0)
///   radtan            x = x0 s(q) + 2 p1 x0 y0 + p2 (q + 2 x0^2)
///                     y = y0 s(q) + p1 (q + 2 y0^2) + 2 p2 x0 y0,     q = x0^2 + y0^2
///   equidistant       (x, y) = t s(t^2) (hx, hy) / |(hx, hy)|,        t = atan2(|(hx, hy)|, hz)
///   photogrammetric   (x0, y0) = (x, y) s(x^2 + y^2), solved for (x, y)
///                     s(q) = 1 + k1 q + k2 q^2 + k3 q^3 + k4 q^4
///   rational          as radtan, with
///   polynomial        s(q) = (1 + k1 q + k2 q^2 + k3 q^3) / (1 + k4 q + k5 q^2 + k6 q^3)
///
///   symbol        shape  unit  frame  meaning
///   h             3      any   cam    the point times a positive factor; x right, y down, z ahead
///   (u, v)        2      px    -      pixel; (0, 0) is the centre of the upper left pixel
///   fx, fy        1      px    -      focal length; > 0
///   cx, cy        1      px    -      principal point
///   k1 to k6      1      -     -      radial distortion: radtan k1 to k3, equidistant k1 to k4,
///                                     photogrammetric k1, k2, rational polynomial k1 to k6
///   p1, p2        1      -     -      tangential distortion of radtan and rational polynomial
///
/// radtan and equidistant equal the models of OpenCV and Kalibr; rational polynomial equals the
/// model of OpenCV and ROS with 8 coefficients. photogrammetric is the model of
/// MonoSLAM with two parameters. Only the inverse of this model, from pixel to ray, has a closed
/// form. In the literature, k1 is often in 1/mm^2 and k2 in 1/mm^4, for lengths on the image
/// sensor. To convert them, multiply k1 by the squared focal length in mm, and k2 by the fourth
/// power of the focal length in mm.
///
/// Defined for  hz > 0 (equidistant: h not on the negative z axis). The radius must be within the
///              range in which the distorted radius increases. Within this range, no two rays share
///              a pixel.
/// Source       [Brown1971], [Kannala2006]; photogrammetric [Civera2008].
struct Camera {
  CameraModel model;
  int width, height;  ///< px
  double fx, fy, cx, cy;
  detail::RadialPolynomial radial;
  std::array<double, 2> p;

  Camera(int width_px, int height_px, double focal_x, double focal_y, double centre_x,
         double centre_y, CameraModel type = CameraModel::kPinhole,
         const std::array<double, 4>& k = {}, const std::array<double, 2>& tangential = {},
         const std::array<double, 3>& denominator = {})
      : model(type),
        width(width_px),
        height(height_px),
        fx(focal_x),
        fy(focal_y),
        cx(centre_x),
        cy(centre_y),
        radial(k, type == CameraModel::kEquidistant ? kPi * kPi : kMaxSquaredRadius, denominator),
        p(tangential) {}
  explicit Camera(Params& params)
      : Camera(params,
               static_cast<CameraModel>(params.Choice(
                   "camera.model",
                   {"pinhole", "radtan", "equidistant", "photogrammetric", "rational_polynomial"},
                   "projection and lens distortion", 0))) {}

  /// Computes the pixel z = (u, v) of h. Returns false if h is out of the domain.
  template <class T>
  bool Project(const T* h, T* z) const {
    T x[2];
    if (model == CameraModel::kEquidistant) {
      if (!FromAngle(h, x)) return false;
    } else {
      if (!(h[2] > T(0.0))) return false;
      const T x0[2] = {h[0] / h[2], h[1] / h[2]};
      if (!Distort(x0, x)) return false;
    }
    z[0] = cx + fx * x[0];
    z[1] = cy + fy * x[1];
    return true;
  }
  /// Computes a vector h, of any positive length, whose pixel is z = (u, v). Returns false if no
  /// such vector exists.
  template <class T>
  bool Unproject(const T* z, T* h) const {
    const T x[2] = {(z[0] - cx) / fx, (z[1] - cy) / fy};
    if (model == CameraModel::kEquidistant) return ToAngle(x, h);
    h[2] = T(1.0);
    return Undistort(x, h);
  }
  /// Returns true if the pixel z = (u, v) is inside the image.
  bool Contains(const double* z) const {
    return z[0] >= -0.5 && z[0] <= width - 0.5 && z[1] >= -0.5 && z[1] <= height - 0.5;
  }

 private:
  static constexpr double kPi = 3.14159265358979323846;
  static constexpr double kMaxSquaredRadius = 1e4;  ///< limit of x0^2 + y0^2 (89.4 deg)
  static constexpr double kSmallSquaredAngle =
      1e-6;  ///< rad^2; below this limit, power series replace sin, cos and atan2

  Camera(Params& params, CameraModel type)
      : Camera{params.Integer("camera.width", "image width in px", 1, 1 << 20),
               params.Integer("camera.height", "image height in px", 1, 1 << 20),
               params.Positive("camera.fx", "px", "horizontal focal length"),
               params.Positive("camera.fy", "px", "vertical focal length"),
               params.Number("camera.cx", "px", "u of the principal point"),
               params.Number("camera.cy", "px", "v of the principal point"),
               type,
               ReadRadial(params, type),
               ReadTangential(params, type),
               ReadDenominator(params, type)} {}
  static std::array<double, 4> ReadRadial(Params& params, CameraModel type) {
    std::array<double, 4> k{};
    if (type == CameraModel::kPinhole) return k;
    k[0] = params.Number("camera.k1", "", "radial distortion");
    k[1] = params.Number("camera.k2", "", "radial distortion");
    if (type == CameraModel::kPhotogrammetric) return k;
    k[2] = params.Number("camera.k3", "", "radial distortion", {}, 0.0);
    if (type != CameraModel::kEquidistant) return k;
    k[3] = params.Number("camera.k4", "", "radial distortion", {}, 0.0);
    return k;
  }
  static std::array<double, 2> ReadTangential(Params& params, CameraModel type) {
    if (!HasTangential(type)) return {};
    return {params.Number("camera.p1", "", "tangential distortion"),
            params.Number("camera.p2", "", "tangential distortion")};
  }
  static std::array<double, 3> ReadDenominator(Params& params, CameraModel type) {
    if (type != CameraModel::kRationalPolynomial) return {};
    return {params.Number("camera.k4", "", "radial distortion, in the denominator"),
            params.Number("camera.k5", "", "radial distortion, in the denominator"),
            params.Number("camera.k6", "", "radial distortion, in the denominator")};
  }
  static bool HasTangential(CameraModel type) {
    return type == CameraModel::kRadtan || type == CameraModel::kRationalPolynomial;
  }

  template <class T>
  bool Distort(const T* x0, T* x) const {
    T factor = T(1.0);
    if (model == CameraModel::kPhotogrammetric) {
      T q;
      if (!radial.Invert(T(x0[0] * x0[0] + x0[1] * x0[1]), &q)) return false;
      factor = 1.0 / radial.Factor(q);
    } else if (HasTangential(model)) {
      return DistortRadtan(x0, x);
    }
    for (int i = 0; i < 2; ++i) x[i] = factor * x0[i];
    return true;
  }
  template <class T>
  bool Undistort(const T* x, T* x0) const {
    if (HasTangential(model)) return UndistortRadtan(x, x0);
    const T q = x[0] * x[0] + x[1] * x[1];
    const bool has_lens = model == CameraModel::kPhotogrammetric;
    if (has_lens && !(detail::ValueOf(q) <= radial.q_max)) return false;
    for (int i = 0; i < 2; ++i) x0[i] = has_lens ? T(x[i] * radial.Factor(q)) : x[i];
    return true;
  }
  template <class T>
  bool DistortRadtan(const T* x0, T* x) const {
    const T q = x0[0] * x0[0] + x0[1] * x0[1], xy = x0[0] * x0[1];
    if (!(detail::ValueOf(q) <= radial.q_max)) return false;
    const T s = radial.Factor(q);
    x[0] = x0[0] * s + 2.0 * p[0] * xy + p[1] * (q + 2.0 * x0[0] * x0[0]);
    x[1] = x0[1] * s + p[0] * (q + 2.0 * x0[1] * x0[1]) + 2.0 * p[1] * xy;
    return true;
  }
  /// Solves DistortRadtan(x0) = x by Newton's method. Starts at the solution without tangential
  /// distortion. The last step also computes the derivatives of x0.
  template <class T>
  bool UndistortRadtan(const T* x, T* x0) const {
    const double target[2] = {detail::ValueOf(x[0]), detail::ValueOf(x[1])};
    double q, solution[2], distorted[2];
    if (!radial.Invert(target[0] * target[0] + target[1] * target[1], &q)) return false;
    for (int i = 0; i < 2; ++i) solution[i] = target[i] / radial.Factor(q);
    constexpr int kSteps = 20;  // about 5 steps are sufficient
    for (int k = 0; k < kSteps; ++k) {
      if (!DistortRadtan(solution, distorted)) return false;
      SolveRadtan(solution, target, distorted, solution);
    }
    constexpr double kRounding = 1e-12;
    if (!DistortRadtan(solution, distorted)) return false;
    if (!(std::hypot(target[0] - distorted[0], target[1] - distorted[1]) < kRounding)) return false;
    SolveRadtan(solution, x, distorted, x0);
    return true;
  }
  /// Computes one Newton step, next = solution + J^-1 (target - distorted). J is the Jacobian of
  /// DistortRadtan at `solution`.
  template <class T>
  void SolveRadtan(const double* solution, const T* target, const double* distorted,
                   T* next) const {
    const double x = solution[0], y = solution[1], q = x * x + y * y;
    const double s = radial.Factor(q), ds = radial.FactorSlope(q);
    const double a = s + 2.0 * x * x * ds + 2.0 * p[0] * y + 6.0 * p[1] * x;
    const double b = 2.0 * x * y * ds + 2.0 * p[0] * x + 2.0 * p[1] * y;
    const double d = s + 2.0 * y * y * ds + 6.0 * p[0] * y + 2.0 * p[1] * x;
    const double determinant = a * d - b * b;
    const T residual[2] = {target[0] - distorted[0], target[1] - distorted[1]};
    next[0] = x + (d * residual[0] - b * residual[1]) / determinant;
    next[1] = y + (a * residual[1] - b * residual[0]) / determinant;
  }
  template <class T>
  bool FromAngle(const T* h, T* x) const {
    using std::atan2;
    using std::sqrt;
    const T r2 = h[0] * h[0] + h[1] * h[1];
    T scale;  // t / r of the equidistant model
    if (h[2] > T(0.0) && r2 < kSmallSquaredAngle * h[2] * h[2]) {
      const T tan2 = r2 / (h[2] * h[2]);
      scale = (1.0 - tan2 * (1.0 / 3.0 - tan2 / 5.0)) / h[2];
    } else {
      if (!(r2 > T(0.0))) return false;
      const T r = sqrt(r2);
      scale = atan2(r, h[2]) / r;
    }
    const T q = scale * scale * r2;
    if (!(detail::ValueOf(q) <= radial.q_max)) return false;
    for (int i = 0; i < 2; ++i) x[i] = scale * radial.Factor(q) * h[i];
    return true;
  }
  template <class T>
  bool ToAngle(const T* x, T* h) const {
    using std::cos;
    using std::sin;
    using std::sqrt;
    T q;
    if (!radial.Invert(T(x[0] * x[0] + x[1] * x[1]), &q)) return false;
    T sine = 1.0 - q / 6.0 * (1.0 - q / 20.0);  // sin t / t
    h[2] = 1.0 - q / 2.0 * (1.0 - q / 12.0);
    if (q > T(kSmallSquaredAngle)) {
      const T t = sqrt(q);
      sine = sin(t) / t;
      h[2] = cos(t);
    }
    for (int i = 0; i < 2; ++i) h[i] = sine / radial.Factor(q) * x[i];
    return true;
  }
};

}  // namespace alidade
