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

}  // namespace alidade
