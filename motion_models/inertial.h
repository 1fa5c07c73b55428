// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/arc.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// How `Inertial` integrates the specific force while the body turns. The value is the order in dt
/// of the error of a step, or 0 for an exact integral.
enum class InertialIntegration { kExact = 0, kEuler = 2, kMidpoint = 3 };

/// Body with an inertial measurement unit (strapdown navigation).
///
///   model      r' = r + v dt + (R(q) Y_2 f + g) dt^2/2,   v' = v + (R(q) Y_1 f + g) dt
///              q' = q Exp(phi),   b_omega' = b_omega + w_1,   b_f' = b_f + w_2
///              phi = (omega - b_omega - w_omega) dt,   f = f_m - b_f - w_f
///              exact      Y_1 = Gamma_1(phi),  Y_2 = 2 Gamma_2(phi): the integrals over dt of
///                         force and turn that are constant in the body
///              euler      Y_1 = Y_2 = I: the orientation at the start
///              midpoint   Y_1 = Y_2 = Exp(phi/2): the orientation in the middle of the step
///              b_omega, b_f are model parameter states, known to be 0 unless the config defines
///              initial values
///   noise      continuous: (w_omega, w_f) ~ N(0, diag(sigma_omega^2, sigma_f^2) / dt), white
///              noise of the readings; (w_1, w_2) ~ N(0, diag(sigma_1^2, sigma_2^2) dt), random
///              walks of the biases
///   Jacobian   automatic differentiation               15 x 15; exact at phi = 0
///
///   symbol       shape  unit       frame  meaning
///   r, v         3      m, m/s     world  position, velocity
///   q            4      -          -      orientation, world_from_body
///   omega, f_m   3      rad/s      body   control input: measured angular velocity and specific
///                       m/s^2             force, constant over dt
///   b_omega      3      rad/s      body   bias of the gyroscope
///   b_f          3      m/s^2      body   bias of the accelerometer
///   g            3      m/s^2      world  gravity; a body at rest measures f_m = -R' g
///   sigma_omega  3      rad/s^0.5  body   noise of the gyroscope for each axis, the root of its
///                                         spectral density (angle random walk); >= 0
///   sigma_f      3      m/s^1.5    body   noise of the accelerometer for each axis, the root of
///                                         its spectral density (velocity random walk); >= 0
///   sigma_1      1      rad/s^1.5  body   standard deviation of the change of b_omega in one
///                                         second; >= 0
///   sigma_2      1      m/s^2.5    body   the same of b_f; >= 0
///
/// Defined everywhere. The world does not rotate. Steps without noise are exact, or of the declared
/// order in dt. The noise of r is correct to first order in dt.
/// Source       [Sola2017] sec. 5.4 (Euler's method); Gamma_1, Gamma_2: [Hartley2020] sec. 3.4.
template <InertialIntegration kIntegration = InertialIntegration::kExact>
struct Inertial : Motion<12, Vec<3>, UnitQuaternion, Vec<3>, Vec<3>, Vec<3>> {
  static constexpr std::array kBlocks{
      Quantity{"position", "m", "position of the body in the world", "x,y,z"},
      Quantity{"orientation", "", "orientation of the body, world_from_body", "w,x,y,z"},
      Quantity{"velocity", "m/s", "velocity of the body in the world", "x,y,z"},
      Quantity{"gyro_bias", "rad/s", "bias of the gyroscope, in the frame of the body", "x,y,z",
               ALIDADE_ROLE_OWNED},
      Quantity{"accelerometer_bias", "m/s^2", "bias of the accelerometer, in the frame of the body",
               "x,y,z", ALIDADE_ROLE_OWNED}};
  using Input = Vec<6>;
  static constexpr Quantity kInput{
      "imu", "", "angular velocity, rad/s, and specific force, m/s^2, in the frame of the body",
      "wx,wy,wz,fx,fy,fz"};
  static constexpr int kStepOrder = static_cast<int>(kIntegration);

  InputNoise<6> noise;
  std::array<double, 3> gravity;
  double gyro_bias_walk, accelerometer_bias_walk;

  Inertial(const std::array<double, 3>& gyro, const std::array<double, 3>& accelerometer,
           const std::array<double, 3>& gravity_m_s2 = {0.0, 0.0, -9.80665}, double gyro_bias = 0.0,
           double accelerometer_bias = 0.0)
      : noise{NoiseKind::kContinuous,
              {gyro[0], gyro[1], gyro[2], accelerometer[0], accelerometer[1], accelerometer[2]}},
        gravity(gravity_m_s2),
        gyro_bias_walk(gyro_bias),
        accelerometer_bias_walk(accelerometer_bias) {}
  explicit Inertial(Params& p)
      : Inertial{
            p.PerAxis<3>("noise.gyro", "rad/s^0.5",
                         "root of the spectral density of the gyroscope's noise", kNonNegative),
            p.PerAxis<3>("noise.accelerometer", "m/s^1.5",
                         "root of the spectral density of the accelerometer's noise", kNonNegative),
            p.Vector<3>("gravity_m_s2", "m/s^2", "acceleration of gravity in the world", {},
                        std::array<double, 3>{0.0, 0.0, -9.80665}),
            p.NonNegative("noise.gyro_bias", "rad/s^1.5",
                          "standard deviation of the change of the bias in one second", 0.0),
            p.NonNegative("noise.accelerometer_bias", "m/s^2.5",
                          "standard deviation of the change of the bias in one second", 0.0)} {}

  template <class T>
  void Step(const T* r, const T* q, const T* v, const T* gyro_bias, const T* accelerometer_bias,
            const T* u, const T* w, double dt_s, T* r1, T* q1, T* v1, T* gyro_bias1,
            T* accelerometer_bias1) const {
    T turn[3], force[3], mean[3], twice_mean[3], velocity_change[3], shift[3];
    for (int i = 0; i < 3; ++i) {
      turn[i] = dt_s * (u[i] - gyro_bias[i] - w[i]);
      force[i] = u[3 + i] - accelerometer_bias[i] - w[3 + i];
    }
    IntegrateForce(turn, force, mean, twice_mean);
    UnitQuaternion::Rotate(q, mean, velocity_change);
    UnitQuaternion::Rotate(q, twice_mean, shift);
    for (std::size_t i = 0; i < 3; ++i) {
      r1[i] = r[i] + dt_s * v[i] + 0.5 * dt_s * dt_s * (shift[i] + gravity[i]);
      v1[i] = v[i] + dt_s * (velocity_change[i] + gravity[i]);
      gyro_bias1[i] = gyro_bias[i] + w[6 + i];
      accelerometer_bias1[i] = accelerometer_bias[i] + w[9 + i];
    }
    UnitQuaternion::Plus(q, turn, q1);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    noise.SqrtQ(dt_s, l);
    for (int i = 6; i < 12; ++i) {
      l(i, i) = (i < 9 ? gyro_bias_walk : accelerometer_bias_walk) * std::sqrt(dt_s);
    }
  }

 private:
  /// Computes y_1 = Y_1 f and y_2 = Y_2 f in the frame of the body at the start of the step.
  template <class T>
  static void IntegrateForce(const T* turn, const T* f, T* y_1, T* y_2) {
    if constexpr (kIntegration == InertialIntegration::kExact) {
      IntegrateTurn<1>(turn, f, y_1);
      IntegrateTurn<2>(turn, f, y_2);
      for (int i = 0; i < 3; ++i) y_2[i] = 2.0 * y_2[i];
    } else {
      const double part = kIntegration == InertialIntegration::kMidpoint ? 0.5 : 0.0;
      const T half_turn[3] = {part * turn[0], part * turn[1], part * turn[2]};
      IntegrateTurn<0>(half_turn, f, y_1);
      for (int i = 0; i < 3; ++i) y_2[i] = y_1[i];
    }
  }
};

}  // namespace alidade
