// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "alidade/model/model.h"

/// Parts that the sensors of a moving body share, in the plane (D = 2) and in space (D = 3): the
/// attitude of the body, and the lever arm and the mounting of a sensor on the body.
namespace alidade {

/// Names of the elements of a vector in D dimensions.
template <int D>
inline constexpr const char* kAxes = D == 1   ? ""
                                     : D == 2 ? "x,y"
                                              : "x,y,z";

/// Rotations in D dimensions. `Rotation` is the geometry of an attitude: an angle in the plane,
/// counter-clockwise from the x axis, or a unit quaternion in space. `Rate` is the geometry of an
/// angular velocity. A null attitude is the identity.
template <int D>
struct Body;

template <>
struct Body<2> {
  using Rotation = Angle;
  using Rate = Vec<1>;
  /// Returns the role of the attitude.
  static constexpr Quantity Attitude(unsigned flags = 0) {
    return {"heading", "rad", "heading of the body, counter-clockwise from the x axis", "", flags};
  }
  /// Returns the role of the angular velocity.
  static constexpr Quantity AngularVelocity(unsigned flags = 0) {
    return {"turn_rate", "rad/s", "turn rate of the body, counter-clockwise", "", flags};
  }
  /// Returns the role of the mounting: the attitude of the sensor on the body.
  static constexpr Quantity Mounting() {
    return {"mounting", "rad", "angle of the sensor, body_from_sensor", "", ALIDADE_ROLE_OWNED};
  }

  /// Computes y = R x.
  template <class T>
  static void Rotate(const T* attitude, const T* x, T* y) {
    Turn(attitude, 1.0, x, y);
  }
  /// Computes y = R' x.
  template <class T>
  static void RotateBack(const T* attitude, const T* x, T* y) {
    Turn(attitude, -1.0, x, y);
  }
  /// Computes the attitude c = a b.
  template <class T>
  static void Compose(const T* a, const T* b, T* c) {
    Angle::Plus(a, b, c);
  }
  /// Computes the attitude c = a^-1 b.
  template <class T>
  static void ComposeBack(const T* a, const T* b, T* c) {
    Angle::Minus(b, a, c);
  }
  /// Computes y = omega x r.
  template <class T>
  static void Cross(const T* omega, const T* r, T* y) {
    y[0] = -omega[0] * r[1];
    y[1] = omega[0] * r[0];
  }

 private:
  template <class T>
  static void Turn(const T* attitude, double sign, const T* x, T* y) {
    using std::cos;
    using std::sin;
    const T c = attitude == nullptr ? T(1.0) : T(cos(attitude[0]));
    const T s = attitude == nullptr ? T(0.0) : T(sign * sin(attitude[0]));
    y[0] = c * x[0] - s * x[1];
    y[1] = s * x[0] + c * x[1];
  }
};

template <>
struct Body<3> {
  using Rotation = UnitQuaternion;
  using Rate = Vec<3>;
  /// Returns the role of the attitude.
  static constexpr Quantity Attitude(unsigned flags = 0) {
    return {"orientation", "", "orientation of the body, world_from_body", "w,x,y,z", flags};
  }
  /// Returns the role of the angular velocity.
  static constexpr Quantity AngularVelocity(unsigned flags = 0) {
    return {"angular_velocity", "rad/s", "angular velocity in the frame of the body", "x,y,z",
            flags};
  }
  /// Returns the role of the mounting: the attitude of the sensor on the body.
  static constexpr Quantity Mounting() {
    return {"mounting", "", "orientation of the sensor, body_from_sensor", "w,x,y,z",
            ALIDADE_ROLE_OWNED};
  }

  /// Computes y = R x.
  template <class T>
  static void Rotate(const T* attitude, const T* x, T* y) {
    if (attitude != nullptr) {
      UnitQuaternion::Rotate(attitude, x, y);
    } else {
      for (int i = 0; i < 3; ++i) y[i] = x[i];
    }
  }
  /// Computes y = R' x.
  template <class T>
  static void RotateBack(const T* attitude, const T* x, T* y) {
    if (attitude != nullptr) {
      UnitQuaternion::RotateBack(attitude, x, y);
    } else {
      for (int i = 0; i < 3; ++i) y[i] = x[i];
    }
  }
  /// Computes the attitude c = a b.
  template <class T>
  static void Compose(const T* a, const T* b, T* c) {
    UnitQuaternion::Multiply(a, b, c);
  }
  /// Computes the attitude c = a^-1 b.
  template <class T>
  static void ComposeBack(const T* a, const T* b, T* c) {
    const T inverse[4] = {a[0], -a[1], -a[2], -a[3]};
    UnitQuaternion::Multiply(inverse, b, c);
  }
  /// Computes y = omega x r.
  template <class T>
  static void Cross(const T* omega, const T* r, T* y) {
    y[0] = omega[1] * r[2] - omega[2] * r[1];
    y[1] = omega[2] * r[0] - omega[0] * r[2];
    y[2] = omega[0] * r[1] - omega[1] * r[0];
  }
};

/// Returns the role of a lever arm: the position of the sensor in the frame of the body.
template <int D>
constexpr Quantity LeverArm() {
  return {"lever_arm", "m", "position of the sensor in the body", kAxes<D>, ALIDADE_ROLE_OWNED};
}

/// Computes h = B' (R' (a - p) - l), a known point a in the frame of a sensor. R and p are the
/// attitude and the position of the body, l and B the lever arm and the mounting of the sensor.
template <int D, class T>
void InSensor(const T* position, const T* attitude, const T* lever_arm, const T* mounting,
              const double* point, T* h) {
  T difference[D], in_body[D];
  for (int i = 0; i < D; ++i) difference[i] = point[i] - position[i];
  Body<D>::RotateBack(attitude, difference, in_body);
  for (int i = 0; i < D; ++i) in_body[i] -= lever_arm[i];
  Body<D>::RotateBack(mounting, in_body, h);
}

/// Base of a sensor that measures a constant vector of the world, such as a field:
///
///   z = B' R' m + b + n,   n ~ N(0, diag(sigma^2))
///
/// R is the orientation of the body, B the mounting and b the bias of the sensor, m the vector.
struct WorldVectorSensor : Sensor<Vec<3>, UnitQuaternion, Vec<3>, UnitQuaternion> {
  std::array<double, 3> sigma, vector_in_world;

  WorldVectorSensor(const std::array<double, 3>& deviation, const std::array<double, 3>& vector)
      : sigma(deviation), vector_in_world(vector) {}

  /// Computes z without noise.
  template <class T>
  bool Predict(const T* orientation, const T* bias, const T* mounting, T* z) const {
    const T vector[3] = {T(vector_in_world[0]), T(vector_in_world[1]), T(vector_in_world[2])};
    T in_body[3];
    Body<3>::RotateBack(orientation, vector, in_body);
    Body<3>::RotateBack(mounting, in_body, z);
    for (int i = 0; i < 3; ++i) z[i] += bias[i];
    return true;
  }
  /// Computes L = diag(sigma).
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < 3; ++i) L[4 * i] = T(sigma[static_cast<std::size_t>(i)]);
  }
};

/// Standard deviations of a pose in D dimensions: of the position, and of the attitude about each
/// axis.
template <int D>
struct PoseNoise {
  static constexpr int kAngles = Body<D>::Rotation::kTangent;

  std::array<double, D> position_m;
  std::array<double, kAngles> attitude_rad;

  /// Reads `sigma_position_m`, and `sigma_heading_rad` or `sigma_orientation_rad`.
  static PoseNoise Read(Params& p) {
    return {p.PerAxis<D>("sigma_position_m", "m", "standard deviation of the position", kPositive),
            p.PerAxis<kAngles>(D == 2 ? "sigma_heading_rad" : "sigma_orientation_rad", "rad",
                               D == 2 ? "standard deviation of the heading"
                                      : "standard deviation of the orientation about each axis",
                               kPositive)};
  }
  /// Writes L, (D + kAngles) x (D + kAngles).
  template <class T>
  void WriteSqrtNoise(T* L) const {
    constexpr int kNext = D + kAngles + 1;
    for (int i = 0; i < D; ++i) L[kNext * i] = T(position_m[static_cast<std::size_t>(i)]);
    for (int i = 0; i < kAngles; ++i) {
      L[kNext * (D + i)] = T(attitude_rad[static_cast<std::size_t>(i)]);
    }
  }
};

}  // namespace alidade
