// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Point with constant acceleration and a random jerk, in D dimensions.
///
///   model      p' = p + v dt + a dt^2/2 + g_p(w),  v' = v + a dt + g_v(w),  a' = a + g_a(w)
///   noise      continuous: a white jerk of spectral density sigma^2. For each axis,
///              Cov(g_p, g_v, g_a) = sigma^2 [dt^5/20 dt^4/8 dt^3/6; . dt^3/3 dt^2/2; . . dt].
///              (g_p, g_v, g_a) is its Cholesky factor times w ~ N(0, I). The division of dt into
///              steps does not change Q
///   noise      discrete: w = j ~ N(0, sigma^2 I), a jerk that is constant between two updates.
///              g_p = j dt^3/6, g_v = j dt^2/2, g_a = j dt; Q has rank 1 for each axis, and its
///              effect depends on the rate of the measurements
///   Jacobian   F = [I  dt I  dt^2/2 I; 0  I  dt I; 0  0  I]     3D x 3D
///
///   symbol     shape  unit                     frame  meaning
///   p, v, a    D      m, m/s, m/s^2            any    position, velocity, acceleration
///   sigma      1      m/s^2.5 (continuous)     any    root of the spectral density
///                     m/s^3 (discrete)                or standard deviation of the jerk; >= 0
///   D          -      -                        -      1 to 3
///
/// Defined everywhere. docs/noise_models.md compares both kinds of noise.
/// Source       [BarShalom2001] sec. 6.2.3.
template <int D, bool kContinuous>
struct ConstantAcceleration : Motion<kContinuous ? 3 * D : D, Vec<D>, Vec<D>, Vec<D>> {
  static constexpr const char* kElements = D == 1 ? "" : D == 2 ? "x,y" : "x,y,z";
  static constexpr std::array kBlocks{Quantity{"position", "m", "position", kElements},
                                      Quantity{"velocity", "m/s", "velocity", kElements},
                                      Quantity{"acceleration", "m/s^2", "acceleration", kElements}};

  double sigma;

  explicit ConstantAcceleration(double jerk) : sigma(jerk) {}
  explicit ConstantAcceleration(Params& p)
      : sigma(p.NonNegative("noise.jerk", kContinuous ? "m/s^2.5" : "m/s^3",
                            kContinuous ? "root of the spectral density of the jerk"
                                        : "standard deviation of the jerk")) {}

  NoiseKind noise_kind() const {
    return kContinuous ? NoiseKind::kContinuous : NoiseKind::kDiscrete;
  }
  template <class T>
  void Step(const T* p, const T* v, const T* a, const T* w, double dt_s, T* p1, T* v1,
            T* a1) const {
    for (int i = 0; i < D; ++i) {
      // The noise of p, v and a is w itself, or the effect of the jerk w.
      const T& jerk = w[i];
      const T g_p = kContinuous ? w[i] : T(dt_s * dt_s * dt_s / 6.0 * jerk);
      const T g_v = kContinuous ? w[kContinuous ? D + i : i] : T(0.5 * dt_s * dt_s * jerk);
      const T g_a = kContinuous ? w[kContinuous ? 2 * D + i : i] : T(dt_s * jerk);
      p1[i] = p[i] + dt_s * v[i] + 0.5 * dt_s * dt_s * a[i] + g_p;
      v1[i] = v[i] + dt_s * a[i] + g_v;
      a1[i] = a[i] + g_a;
    }
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    const double root = sigma * std::sqrt(dt_s), root5 = std::sqrt(5.0), root3 = std::sqrt(3.0);
    for (int i = 0; i < D; ++i) {
      if (!kContinuous) {
        l(i, i) = sigma;
        continue;
      }
      l(i, i) = root * dt_s * dt_s / (2.0 * root5);
      l(D + i, i) = root * dt_s * root5 / 4.0;
      l(2 * D + i, i) = root * root5 / 3.0;
      l(D + i, D + i) = root * dt_s / (4.0 * root3);
      l(2 * D + i, D + i) = root / root3;
      l(2 * D + i, 2 * D + i) = root / 3.0;
    }
  }
};

}  // namespace alidade
