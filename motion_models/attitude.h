// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/process_noise.h"

namespace alidade {

/// Orientation of a body whose angular velocity is measured by a gyroscope.
///
///   model      q' = q Exp((omega - b - w) dt),   b' = b + w_b
///              b is a model parameter state, known to be 0 unless the config defines an initial
///              value
///   noise      continuous: w ~ N(0, sigma^2 I / dt), white noise of the gyroscope, and
///              w_b ~ N(0, sigma_b^2 dt I), a random walk
///   Jacobian   automatic differentiation               6 x 6; exact at omega = 0
///
///   symbol     shape  unit       frame  meaning
///   q          4      -          -      orientation, world_from_body
///   omega      3      rad/s      body   control input: measured angular velocity, constant over dt
///   b          3      rad/s      body   bias of the gyroscope
///   sigma      3      rad/s^0.5  body   noise of the gyroscope for each axis, the root of its
///                                       spectral density (angle random walk); >= 0
///   sigma_b    1      rad/s^1.5  body   standard deviation of the change of b in one second; >= 0
///
/// Defined everywhere. Steps without noise are exact.
/// Source       [Sola2017] sec. 4.6, 5.1.
struct Attitude : Motion<6, UnitQuaternion, Vec<3>> {
  static constexpr std::array kBlocks{
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"},
      Quantity{"gyro_bias", "rad/s", "bias of the gyroscope, in the frame of the body", "x,y,z",
               ALIDADE_ROLE_OWNED}};
  using Input = Vec<3>;
  static constexpr Quantity kInput{"gyro", "rad/s", "angular velocity in the frame of the body",
                                   "x,y,z"};

  InputNoise<3> noise;
  double bias_walk;

  explicit Attitude(const std::array<double, 3>& gyro, double gyro_bias = 0.0)
      : noise{NoiseKind::kContinuous, gyro}, bias_walk(gyro_bias) {}
  explicit Attitude(Params& p)
      : Attitude{
            p.PerAxis<3>("noise.gyro", "rad/s^0.5",
                         "root of the spectral density of the gyroscope's noise", kNonNegative),
            p.NonNegative("noise.gyro_bias", "rad/s^1.5",
                          "standard deviation of the change of the bias in one second", 0.0)} {}

  template <class T>
  void Step(const T* q, const T* b, const T* u, const T* w, double dt_s, T* q1, T* b1) const {
    T turn[3];
    for (int i = 0; i < 3; ++i) {
      turn[i] = dt_s * (u[i] - b[i] - w[i]);
      b1[i] = b[i] + w[3 + i];
    }
    UnitQuaternion::Plus(q, turn, q1);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    noise.SqrtQ(dt_s, l);
    for (int i = 3; i < 6; ++i) l(i, i) = bias_walk * std::sqrt(dt_s);
  }
};

}  // namespace alidade
