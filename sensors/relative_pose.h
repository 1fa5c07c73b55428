// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"

namespace alidade {

/// Pose of a landmark relative to the body, in the plane (D = 2) or in space (D = 3). The landmark
/// is a fiducial tag, an object, a station or a keyframe. A keyframe is the pose of the body at an
/// earlier time. Odometry and loop closures are measured relative to a keyframe. To create a
/// keyframe, measure a new landmark at the neutral pose without noise. The pose of the landmark is
/// then a clone of the body's pose, with all correlations.
///
///   model      z = (R_BW (p - r) + n_r, (q^-1 s) (+) n_q),   (n_r, n_q) ~ N(0, R)
///   Jacobian   automatic differentiation               3 x 6, 6 x 12
///   noise      R = diag(sigma_r^2, sigma_q^2), or the covariance of the measurement
///                                                      3x3, 6x6, m^2, m rad, rad^2
///   inverse    p = r + R_WB z_r,   s = q z_q
///
///   symbol     shape  unit    frame     meaning
///   r, q       -      m, -    world     position and attitude (world_from_body) of the body. An
///                                       attitude is a heading in the plane, in rad, and an
///                                       orientation in space
///   p, s       -      m, -    world     position and attitude (world_from_landmark) of the
///                                       landmark
///   z_r        2, 3   m       body      position of the landmark
///   z_q        1, 4   rad, -  body      attitude of the landmark, body_from_landmark
///   n_r        2, 3   m       body      noise of z_r
///   n_q        1, 3   rad     landmark  noise of z_q, q (+) n = q Exp(n)
///   sigma_r, sigma_q  -  m, rad  body, landmark          standard deviation for each axis; > 0
///
/// Defined everywhere.
/// Source       clones [Roumeliotis2002]; q (+) n [Sola2017] ch. 4.
template <int D>
struct RelativePose : Sensor<Product<Vec<D>, typename Body<D>::Rotation>, Vec<D>,
                             typename Body<D>::Rotation, Vec<D>, typename Body<D>::Rotation> {
  using Rotation = typename Body<D>::Rotation;
  static constexpr std::array kRoles{
      Quantity{"position", "m", "position of the body in the world", kAxes<D>}, Body<D>::Attitude(),
      Quantity{"landmark_position", "m", "position of the landmark in the world", kAxes<D>,
               ALIDADE_ROLE_LANDMARK},
      D == 2
          ? Quantity{"landmark_heading", "rad", "heading of the landmark", "",
                     ALIDADE_ROLE_LANDMARK}
          : Quantity{"landmark_orientation", "", "orientation of the landmark, world_from_landmark",
                     "w,x,y,z", ALIDADE_ROLE_LANDMARK}};
  static constexpr Quantity kMeasurement{"relative_pose", "",
                                         "pose of the landmark in the frame of the body"};
  static constexpr std::array kParts{
      Quantity{"position", "m", "position of the landmark in the frame of the body", kAxes<D>},
      D == 2 ? Quantity{"heading", "rad", "heading of the landmark in the frame of the body"}
             : Quantity{"orientation", "", "orientation of the landmark, body_from_landmark",
                        "w,x,y,z"}};
  static constexpr int kInitialises = 2;

  PoseNoise<D> sigma;

  RelativePose(const std::array<double, D>& position_m,
               const std::array<double, Rotation::kTangent>& attitude_rad)
      : sigma{position_m, attitude_rad} {}
  explicit RelativePose(Params& p) : sigma(PoseNoise<D>::Read(p)) {}

  template <class T>
  bool Predict(const T* position, const T* attitude, const T* landmark_position,
               const T* landmark_attitude, T* z) const {
    T offset[D];
    for (int i = 0; i < D; ++i) offset[i] = landmark_position[i] - position[i];
    Body<D>::RotateBack(attitude, offset, z);
    Body<D>::ComposeBack(attitude, landmark_attitude, z + D);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, T* L) const {
    sigma.WriteSqrtNoise(L);
  }
  template <class T>
  bool Initialise(const T* position, const T* attitude, const T* z, T* landmark) const {
    Body<D>::Rotate(attitude, z, landmark);
    for (int i = 0; i < D; ++i) landmark[i] += position[i];
    Body<D>::Compose(attitude, z + D, landmark + D);
    return true;
  }
};

}  // namespace alidade
