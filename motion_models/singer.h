// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Manoeuvring point in D dimensions: its acceleration is a first-order Gauss-Markov process.
///
///   model      a' = e^(-x) a + w_a,          x = dt/tau
///              v' = v + tau (1 - e^(-x)) a + w_v
///              p' = p + v dt + tau^2 (x - 1 + e^(-x)) a + w_p
///   noise      w ~ N(0, Q), the exact integral of the white noise that drives a. For each axis,
///              Q_pp = sigma^2 tau^4 (1 - e^(-2x) + 2 x - 2 x^2 + 2 x^3/3 - 4 x e^(-x))
///              Q_pv = sigma^2 tau^3 (1 + e^(-2x) - 2 e^(-x) + 2 x e^(-x) - 2 x + x^2)
///              Q_pa = sigma^2 tau^2 (1 - e^(-2x) - 2 x e^(-x))
///              Q_vv = sigma^2 tau^2 (4 e^(-x) - 3 - e^(-2x) + 2 x)
///              Q_va = sigma^2 tau (1 - e^(-x))^2,   Q_aa = sigma^2 (1 - e^(-2x))
///   Jacobian   by automatic differentiation            3D x 3D
///
///   symbol     shape  unit           frame  meaning
///   p, v, a    D      m, m/s, m/s^2  any    position, velocity, acceleration
///   sigma      1      m/s^2          any    stationary standard deviation of a; >= 0
///   tau        1      s              -      time constant of a manoeuvre; > 0
///   D          -      -              -      1 to 3
///
/// Defined everywhere. For tau much longer than dt, the model approaches constant_acceleration with
/// a jerk of the density 2 sigma^2 / tau.
/// Source       [Singer1970]; [BarShalom2001] sec. 8.2.
template <int D>
struct Singer : Motion<3 * D, Vec<D>, Vec<D>, Vec<D>> {
  static constexpr const char* kElements = D == 1 ? "" : D == 2 ? "x,y" : "x,y,z";
  static constexpr std::array kBlocks{Quantity{"position", "m", "position", kElements},
                                      Quantity{"velocity", "m/s", "velocity", kElements},
                                      Quantity{"acceleration", "m/s^2", "acceleration", kElements}};

  double sigma, tau_s;

  Singer(double acceleration, double time_constant_s)
      : sigma(acceleration), tau_s(time_constant_s) {}
  explicit Singer(Params& p)
      : Singer{p.NonNegative("noise.acceleration", "m/s^2",
                             "standard deviation of the acceleration after a long time"),
               p.Positive("time_constant_s", "s",
                          "time in which the correlation of the acceleration falls to 1/e")} {}

  template <class T>
  void Step(const T* p, const T* v, const T* a, const T* w, double dt_s, T* p1, T* v1,
            T* a1) const {
    const double x = dt_s / tau_s, change = std::expm1(-x);
    for (int i = 0; i < D; ++i) {
      p1[i] = p[i] + dt_s * v[i] + tau_s * tau_s * (x + change) * a[i] + w[i];
      v1[i] = v[i] - tau_s * change * a[i] + w[D + i];
      a1[i] = (1.0 + change) * a[i] + w[2 * D + i];
    }
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    const Covariance q(dt_s / tau_s);
    if (!(q.pp > 0.0)) return;  // dt = 0
    // Cholesky factor of Q / (sigma^2 diag(tau^2, tau, 1)^2).
    const double l_pp = std::sqrt(q.pp), l_vp = q.pv / l_pp, l_ap = q.pa / l_pp;
    const double l_vv = std::sqrt(q.vv - l_vp * l_vp), l_av = (q.va - l_vp * l_ap) / l_vv;
    const double l_aa = std::sqrt(q.aa - l_ap * l_ap - l_av * l_av);
    const double unit_p = sigma * tau_s * tau_s, unit_v = sigma * tau_s;
    for (int i = 0; i < D; ++i) {
      l(i, i) = unit_p * l_pp;
      l(D + i, i) = unit_v * l_vp;
      l(D + i, D + i) = unit_v * l_vv;
      l(2 * D + i, i) = sigma * l_ap;
      l(2 * D + i, D + i) = sigma * l_av;
      l(2 * D + i, 2 * D + i) = sigma * l_aa;
    }
  }

 private:
  /// Elements of Q of one axis for sigma = tau = 1.
  struct Covariance {
    double pp = 0.0, pv = 0.0, pa = 0.0, vv = 0.0, va, aa;

    explicit Covariance(double x) : va(std::expm1(-x) * std::expm1(-x)), aa(-std::expm1(-2.0 * x)) {
      if (x > 1.0) {
        const double e = std::exp(-x), e2 = e * e;
        pp = 1.0 - e2 + 2.0 * x - 2.0 * x * x + 2.0 / 3.0 * x * x * x - 4.0 * x * e;
        pv = 1.0 + e2 - 2.0 * e + 2.0 * x * e - 2.0 * x + x * x;
        pa = 1.0 - e2 - 2.0 * x * e;
        vv = 4.0 * e - 3.0 - e2 + 2.0 * x;
        return;
      }
      // The leading terms of the closed form cancel. The sums below are its remaining power series,
      // with s = (-x)^n / n!, t = (-2 x)^n / n! and r = x (-x)^(n-1) / (n-1)!.
      constexpr int kTerms = 26;  // the next term is below 1e-17 of the first
      double s = x * x / 2.0, t = 2.0 * x * x;
      for (int n = 3; n <= kTerms; ++n) {
        s *= -x / n;
        t *= -2.0 * x / n;
        const double r = -n * s;
        vv += 4.0 * s - t;
        pa += -t - 2.0 * r;
        if (n >= 4) pv += t - 2.0 * s + 2.0 * r;
        if (n >= 5) pp += -t - 4.0 * r;
      }
    }
  };
};

}  // namespace alidade
