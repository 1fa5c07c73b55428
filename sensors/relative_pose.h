// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Pose of a landmark relative to the body. The landmark is a fiducial tag, an object, a station or
/// a keyframe. A keyframe is the pose of the body at an earlier time. Odometry and loop closures
/// are measured relative to a keyframe. To create a keyframe, measure a new landmark at the neutral
/// pose without noise. The pose of the landmark is then a clone of the body's pose, with all
/// correlations.
///
///   model      z = (R_BW (p - r) + n_r, (q^-1 s) (+) n_q),   (n_r, n_q) ~ N(0, R)
///   Jacobian   automatic differentiation               6 x 12
///   noise      R = diag(sigma_r^2, sigma_q^2), or the covariance of the measurement
///                                                      6x6, m^2, m rad, rad^2
///   inverse    p = r + R_WB z_r,   s = q z_q
///
///   symbol     shape  unit    frame     meaning
///   r, q       3, 4   m, -    world     position and orientation (world_from_body) of the body
///   p, s       3, 4   m, -    world     position and orientation (world_from_landmark) of the
///                                       landmark
///   z_r        3      m       body      position of the landmark
///   z_q        4      -       body      orientation of the landmark, body_from_landmark
///   n_r        3      m       body      noise of z_r
///   n_q        3      rad     landmark  noise of z_q, q (+) n = q Exp(n)
///   sigma_r, sigma_q  3  m, rad  body, landmark          standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       clones [Roumeliotis2002]; q (+) n [Sola2017] ch. 4.
struct RelativePose
    : Sensor<Product<Vec<3>, UnitQuaternion>, Vec<3>, UnitQuaternion, Vec<3>, UnitQuaternion> {
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"},
      Quantity{"landmark_position", "m", "position of the landmark in the world", "x,y,z",
               ALIDADE_ROLE_LANDMARK},
      Quantity{"landmark_orientation", "", "orientation of the landmark, world_from_landmark",
               "w,x,y,z", ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"relative_pose", "",
                                         "pose of the landmark in the frame of the body"};
  static constexpr std::array kParts{
      Quantity{"position", "m", "position of the landmark in the frame of the body", "x,y,z"},
      Quantity{"orientation", "", "orientation of the landmark, body_from_landmark", "w,x,y,z"}};
  static constexpr int kInitialises = 2;

  std::array<double, 3> sigma_position_m, sigma_orientation_rad;

  RelativePose(const std::array<double, 3>& position_m,
               const std::array<double, 3>& orientation_rad)
      : sigma_position_m(position_m), sigma_orientation_rad(orientation_rad) {}
  explicit RelativePose(Params& p)
      : RelativePose(
            p.PerAxis<3>("sigma_position_m", "m", "standard deviation along each axis of the body",
                         kPositive),
            p.PerAxis<3>("sigma_orientation_rad", "rad",
                         "standard deviation about each axis of the landmark", kPositive)) {}

  template <class T>
  bool Predict(const T* position, const T* orientation, const T* landmark_position,
               const T* landmark_orientation, T* z) const {
    T offset[3];
    for (int i = 0; i < 3; ++i) offset[i] = landmark_position[i] - position[i];
    UnitQuaternion::RotateBack(orientation, offset, z);
    const T inverse[4] = {orientation[0], -orientation[1], -orientation[2], -orientation[3]};
    UnitQuaternion::Multiply(inverse, landmark_orientation, z + 3);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* L) const {
    for (int i = 0; i < 3; ++i) {
      L[7 * i] = T(sigma_position_m[static_cast<std::size_t>(i)]);
      L[7 * (3 + i)] = T(sigma_orientation_rad[static_cast<std::size_t>(i)]);
    }
  }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* z, T* landmark) const {
    UnitQuaternion::Rotate(orientation, z, landmark);
    for (int i = 0; i < 3; ++i) landmark[i] += position[i];
    UnitQuaternion::Multiply(orientation, z + 3, landmark + 3);
    return true;
  }
};

}  // namespace alidade
