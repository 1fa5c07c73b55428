// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "alidade/model/model.h"
#include "alidade/model/plugin_abi.h"

/// Camera that performs a random walk without rotation, and sensors of landmarks in each
/// representation. For tests.
namespace alidade::testing {

/// Random walk r' = r + sigma sqrt(dt) w.
struct Walk : Motion<3, Vec<3>> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "", "x,y,z"}};
  double sigma = 0.1;
  explicit Walk(double s) : sigma(s) {}
  template <class T>
  void Step(const T* r, const T* w, double, T* next) const {
    for (int i = 0; i < 3; ++i) next[i] = r[i] + w[i];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = sigma * std::sqrt(dt_s);
  }
};

constexpr Quantity kPosition{"position", "m", "", "x,y,z"};
constexpr unsigned kOfLandmark = ALIDADE_ROLE_LANDMARK;

/// Sensor z = p - r. It is linear, so the Kalman filter is exact.
struct Offset : Sensor<Vec<3>, Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{kPosition,
                                     Quantity{"landmark", "m", "", "x,y,z", kOfLandmark}};
  static constexpr Quantity kMeasurement{"offset", "m", "", "x,y,z"};
  static constexpr int kInitialises = 1;
  double sigma = 0.1;
  explicit Offset(double s) : sigma(s) {}
  template <class T>
  bool Predict(const T* r, const T* p, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = p[i] - r[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(sigma);
  }
  template <class T>
  bool Initialise(const T* r, const T* z, T* p) const {
    for (int i = 0; i < 3; ++i) p[i] = r[i] + z[i];
    return true;
  }
};

/// Projection z = (hx, hy) / hz. The camera axes are parallel to the world axes.
struct Pinhole {
  static constexpr Quantity kMeasurement{"pixel", "", "", "u,v"};
  double sigma = 0.01;
  template <class T>
  static bool Project(const T* h, T* z) {
    if (!(h[2] > T(0.0))) return false;
    for (int i = 0; i < 2; ++i) z[i] = h[i] / h[2];
    return true;
  }
};

/// Inverse-depth sensor: h = rho (a - r) + m(theta, phi).
struct InverseDepthPixels : Sensor<Vec<2>, Vec<3>, Vec<6>>, Pinhole {
  static constexpr std::array kRoles{
      kPosition, Quantity{"landmark", "", "", "x0,y0,z0,theta,phi,rho", kOfLandmark}};
  using Pinhole::kMeasurement;
  static constexpr int kInitialises = 1, kPrior = 1;
  explicit InverseDepthPixels(double s) : Pinhole{s} {}
  template <class T>
  bool Predict(const T* r, const T* y, T* z) const {
    using std::cos, std::sin;
    const T m[3] = {cos(y[4]) * sin(y[3]), -sin(y[4]), cos(y[4]) * cos(y[3])};
    T h[3];
    for (int i = 0; i < 3; ++i) h[i] = y[5] * (y[i] - r[i]) + m[i];
    return Project(h, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(sigma);
  }
  template <class T>
  bool Initialise(const T* r, const T* z, const T* rho, T* y) const {
    using std::atan2, std::sqrt;
    for (int i = 0; i < 3; ++i) y[i] = r[i];
    y[3] = atan2(z[0], T(1.0));
    y[4] = atan2(-z[1], sqrt(z[0] * z[0] + T(1.0)));
    y[5] = rho[0];
    return true;
  }
};

/// Sensor of an anchored landmark: h = rho (a - r) + m.
template <unsigned kShared>
struct AnchoredPixels : Sensor<Vec<2>, Vec<3>, Vec<3>, UnitVector, Vec<1>>, Pinhole {
  static constexpr std::array kRoles{kPosition,
                                     Quantity{"anchor", "m", "", "x,y,z", kOfLandmark | kShared},
                                     Quantity{"direction", "", "", "x,y,z", kOfLandmark},
                                     Quantity{"inverse_distance", "1/m", "", "", kOfLandmark}};
  using Pinhole::kMeasurement;
  static constexpr int kInitialises = 1, kPrior = 1;
  explicit AnchoredPixels(double s) : Pinhole{s} {}
  template <class T>
  bool Predict(const T* r, const T* a, const T* m, const T* rho, T* z) const {
    T h[3];
    for (int i = 0; i < 3; ++i) h[i] = rho[0] * (a[i] - r[i]) + m[i];
    return Project(h, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* l) const {
    l[0] = l[3] = T(sigma);
  }
  template <class T>
  bool Initialise(const T* r, const T* z, const T* rho, T* y) const {
    using std::sqrt;
    const T norm = sqrt(z[0] * z[0] + z[1] * z[1] + T(1.0));
    for (int i = 0; i < 3; ++i) y[i] = r[i];
    for (int i = 0; i < 3; ++i) y[3 + i] = (i < 2 ? z[i] : T(1.0)) / norm;
    y[6] = rho[0];
    return true;
  }
};

/// Sensor of a landmark as a point: h = p - r.
struct XyzPixels : Sensor<Vec<2>, Vec<3>, Vec<3>>, Pinhole {
  static constexpr std::array kRoles{kPosition,
                                     Quantity{"landmark", "m", "", "x,y,z", kOfLandmark}};
  using Pinhole::kMeasurement;
  explicit XyzPixels(double s) : Pinhole{s} {}
  template <class T>
  bool Predict(const T* r, const T* p, T* z) const {
    T h[3];
    for (int i = 0; i < 3; ++i) h[i] = p[i] - r[i];
    return Project(h, z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(sigma);
  }
};

}  // namespace alidade::testing
