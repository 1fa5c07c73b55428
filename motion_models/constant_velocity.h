// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/body.h"
#include "alidade/model/process_noise.h"

namespace alidade {

/// Point with constant velocity and a random acceleration, in D dimensions.
///
///   model      p' = p + v dt + g_p(w),  v' = v + g_v(w)
///   noise      continuous (CWNA): a white acceleration of spectral density sigma^2. For each axis,
///              C = Cov(g_p, g_v) = sigma^2 [dt^3/3 dt^2/2; dt^2/2 dt]. (g_p, g_v) is the Cholesky
///              factor of C times w ~ N(0, I). The division of dt into steps does not change Q
///   noise      discrete (DWNA): w = a ~ N(0, sigma^2 I), constant between two updates.
///              g_p = a dt^2/2, g_v = a dt; Q has rank 1 for each axis. n intervals in a second add
///              sigma^2 / n to Var(v), so Var(v) depends on the rate of the measurements
///   Jacobian   F = [I  dt I; 0  I]                     2D x 2D
///
///   symbol     shape  unit                     frame  meaning
///   p, v       D      m, m/s                   any    position, velocity
///   sigma      1      m/s^1.5 (continuous)     any    root of the spectral density
///                     m/s^2 (discrete)                or standard deviation of the acceleration
///   D          -      -                        -      1 to 3
///
/// Defined everywhere. docs/noise_models.md compares both kinds of noise and converts sigma.
/// Source       CWNA [BarShalom2001] sec. 6.2; DWNA sec. 6.3, [Ekf2017] sec. 4.1 (code).
template <int D, bool kContinuous>
struct ConstantVelocity : Motion<kContinuous ? 2 * D : D, Vec<D>, Vec<D>> {
  static constexpr std::array kBlocks{Quantity{"position", "m", "position", kAxes<D>},
                                      Quantity{"velocity", "m/s", "velocity", kAxes<D>}};

  double sigma;

  explicit ConstantVelocity(double acceleration) : sigma(acceleration) {}
  explicit ConstantVelocity(Params& p)
      : sigma(p.NonNegative("noise.acceleration", kContinuous ? "m/s^1.5" : "m/s^2",
                            kContinuous ? "root of the spectral density of the acceleration"
                                        : "standard deviation of the acceleration")) {}

  NoiseKind noise_kind() const {
    return kContinuous ? NoiseKind::kContinuous : NoiseKind::kDiscrete;
  }
  template <class T>
  void Step(const T* p, const T* v, const T* w, double dt_s, T* p1, T* v1) const {
    for (int i = 0; i < D; ++i) {
      p1[i] = p[i] + dt_s * v[i] + (kContinuous ? w[i] : 0.5 * dt_s * dt_s * w[i]);
      v1[i] = v[i] + (kContinuous ? w[kContinuous ? D + i : i] : dt_s * w[i]);
    }
  }
  void StepJacobian(const double*, const double*, const double*, double dt_s, MatrixRef f,
                    MatrixRef g) const {
    for (int i = 0; i < D; ++i) {
      f(i, i) = f(D + i, D + i) = 1.0;
      f(i, D + i) = dt_s;
      g(i, i) = kContinuous ? 1.0 : 0.5 * dt_s * dt_s;
      g(D + i, kContinuous ? D + i : i) = kContinuous ? 1.0 : dt_s;
    }
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < D; ++i) {
      if (kContinuous) {
        SetWhiteAcceleration(sigma, dt_s, i, D + i, l);
      } else {
        l(i, i) = sigma;
      }
    }
  }
};

}  // namespace alidade
