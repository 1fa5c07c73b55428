// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "alidade/model/model.h"

/// Small motion models with a control input, and sensors for these models. For tests.
namespace alidade::testing {

/// Position on a line. The control input is its velocity.
///
///   model      x' = x + (u + w) dt,   w ~ N(0, sigma^2 / dt):  Var(x') = Var(x) + sigma^2 dt
///
///   symbol     shape  unit      meaning
///   x          1      m         position
///   u          1      m/s       velocity, the control input
///   sigma      1      m/s^0.5   noise of the velocity; >= 0
struct Driven : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"position", "m"}};
  using Input = Vec<1>;
  static constexpr Quantity kInput{"speed", "m/s"};
  double sigma;
  explicit Driven(double s) : sigma(s) {}
  explicit Driven(Params& p)
      : sigma(p.NonNegative("noise.speed", "m/s^0.5", "noise of the velocity")) {}
  template <class T>
  void Step(const T* x, const T* u, const T* w, double dt_s, T* next) const {
    next[0] = x[0] + (u[0] + w[0]) * dt_s;
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    l(0, 0) = dt_s > 0.0 ? sigma / std::sqrt(dt_s) : 0.0;
  }
};

/// Body with an accelerometer as the control input. Only a prior determines its orientation.
///
///   model      p' = p + v dt,  v' = v + (R(q) u + g) dt,  q' = q Exp(w sqrt(dt))
///
///   symbol     shape  unit   frame  meaning
///   p, v       3      m, m/s world  position, velocity
///   q          4      -      -      world_from_body
///   u          3      m/s^2  body   specific force, the control input
///   g          3      m/s^2  world  gravity
struct Accelerated : Motion<3, Vec<3>, Vec<3>, UnitQuaternion> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "", "x,y,z"},
                                      Quantity{"velocity", "m/s", "", "x,y,z"},
                                      Quantity{"orientation", "", "", "w,x,y,z"}};
  using Input = Vec<3>;
  static constexpr Quantity kInput{"specific_force", "m/s^2", "", "x,y,z"};
  template <class T>
  void Step(const T* p, const T* v, const T* q, const T* u, const T* w, double dt_s, T* p1, T* v1,
            T* q1) const {
    constexpr double kGravity[3] = {0.0, 0.0, -9.81};
    T force[3], turn[3];
    UnitQuaternion::Rotate(q, u, force);
    for (int i = 0; i < 3; ++i) {
      p1[i] = p[i] + v[i] * dt_s;
      v1[i] = v[i] + (force[i] + kGravity[i]) * dt_s;
      turn[i] = w[i];
    }
    UnitQuaternion::Plus(q, turn, q1);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = 0.01 * std::sqrt(dt_s);
  }
};

/// Body with an inertial unit as the control input. The biases of the unit perform a random walk.
/// The state has 15 tangent elements.
///
///   model      p' = p + v dt,   v' = v + (R(q) (f - b_f + w_f) + g) dt
///              q' = q Exp((omega - b_omega + w_omega) dt),   b' = b + w_b dt
///
///   symbol          shape  unit          frame  meaning
///   p, v            3      m, m/s        world  position, velocity
///   q               4      -             -      world_from_body
///   b_f, b_omega    3      m/s^2, rad/s  body   biases
///   f, omega        3      m/s^2, rad/s  body   specific force and angular velocity, the input
///   w               12     -             -      white noise of densities kDensities
struct Inertial : Motion<12, Vec<3>, Vec<3>, UnitQuaternion, Vec<3>, Vec<3>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "", "x,y,z"}, Quantity{"velocity", "m/s", "", "x,y,z"},
      Quantity{"orientation", "", "", "w,x,y,z"}, Quantity{"force_bias", "m/s^2", "", "x,y,z"},
      Quantity{"rate_bias", "rad/s", "", "x,y,z"}};
  using Input = Vec<6>;
  static constexpr Quantity kInput{"readings", "", "", "fx,fy,fz,wx,wy,wz"};
  static constexpr double kDensities[4] = {0.02, 0.002, 0.001, 0.0001};  // f, omega, b_f, b_omega
  template <class T>
  void Step(const T* p, const T* v, const T* q, const T* b_f, const T* b_omega, const T* u,
            const T* w, double dt_s, T* p1, T* v1, T* q1, T* b_f1, T* b_omega1) const {
    constexpr double kGravity[3] = {0.0, 0.0, -9.81};
    T force[3], turned[3], turn[3];
    for (int i = 0; i < 3; ++i) {
      force[i] = u[i] - b_f[i] + w[i];
      turn[i] = (u[3 + i] - b_omega[i] + w[3 + i]) * dt_s;
    }
    UnitQuaternion::Rotate(q, force, turned);
    UnitQuaternion::Plus(q, turn, q1);
    for (int i = 0; i < 3; ++i) {
      p1[i] = p[i] + v[i] * dt_s;
      v1[i] = v[i] + (turned[i] + kGravity[i]) * dt_s;
      b_f1[i] = b_f[i] + w[6 + i] * dt_s;
      b_omega1[i] = b_omega[i] + w[9 + i] * dt_s;
    }
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 12; ++i) l(i, i) = dt_s > 0.0 ? kDensities[i / 3] / std::sqrt(dt_s) : 0.0;
  }
};

/// Sensor z = x + n.
struct Position3 : Sensor<Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"position", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"position", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = x[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.1);
  }
};

/// Vehicle in the plane, with a mast. The control input is its odometry.
///
///   model      p' = p + v (cos h, sin h) dt,  h' = h + omega dt + w sqrt(dt),  mast' = mast
struct Unicycle : Motion<1, Vec<2>, Angle, Vec<2>> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "", "x,y"},
                                      Quantity{"heading", "rad"},
                                      Quantity{"mast", "m", "in the vehicle", "x,y"}};
  using Input = Vec<2>;
  static constexpr Quantity kInput{"velocities", "", "m/s and rad/s", "v,omega"};
  template <class T>
  void Step(const T* p, const T* h, const T* mast, const T* u, const T* w, double dt_s, T* p1,
            T* h1, T* mast1) const {
    using std::cos, std::sin;
    p1[0] = p[0] + u[0] * cos(h[0]) * dt_s;
    p1[1] = p[1] + u[0] * sin(h[0]) * dt_s;
    h1[0] = h[0] + u[1] * dt_s + w[0];
    for (int i = 0; i < 2; ++i) mast1[i] = mast[i];
  }
  void SqrtQ(double dt_s, MatrixRef l) const { l(0, 0) = 0.01 * std::sqrt(dt_s); }
};

/// Satellite receiver on the mast: z = p + R(h) mast + n.
struct OnMast : Sensor<Vec<2>, Vec<2>, Angle, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"position", "m", "", "x,y"},
                                     Quantity{"heading", "rad"}, Quantity{"mast", "m", "", "x,y"}};
  static constexpr Quantity kMeasurement{"fix", "m", "", "x,y"};
  template <class T>
  bool Predict(const T* p, const T* h, const T* mast, T* z) const {
    using std::cos, std::sin;
    z[0] = p[0] + cos(h[0]) * mast[0] - sin(h[0]) * mast[1];
    z[1] = p[1] + sin(h[0]) * mast[0] + cos(h[0]) * mast[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* l) const {
    l[0] = l[3] = T(0.1);
  }
};

}  // namespace alidade::testing
