// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/model.h"

namespace alidade {

/// Clock of a receiver: its bias, and its drift, the rate of change of the bias.
///
///   model      b' = b + d dt + w_b,   d' = d + w_d
///   noise      continuous: white noise of b and of d. w ~ N(0, Q),
///              Q = [S_b dt + S_d dt^3/3  S_d dt^2/2; S_d dt^2/2  S_d dt],
///              S_b = sigma_b^2, S_d = sigma_d^2; or, from the power-law coefficients of the
///              oscillator, S_b = k^2 h_0/2, S_d = 2 pi^2 k^2 h_-2, k = 1 (s) or the speed of light
///   Jacobian   F = [1 dt; 0 1]                         2 x 2
///
///   symbol     shape  unit            meaning
///   b          1      s or m          bias of the clock; in m: times the speed of light
///   d          1      1 or m/s        drift of the clock
///   sigma_b    1      s^0.5, m/s^0.5  root of the spectral density of the noise of b; >= 0
///   sigma_d    1      s^-0.5, m/s^1.5 root of the spectral density of the noise of d; >= 0
///   h_0        1      s               white frequency noise (two-sample variance h_0/(2 T)); >= 0
///   h_-2       1      1/s             random walk of the frequency; >= 0
///
/// Defined everywhere. The division of dt into steps does not change Q.
/// Source       [Brown2012] sec. 9.3.
template <bool kInMetres>
struct Clock : Motion<2, Vec<1>, Vec<1>> {
  static constexpr std::array kBlocks{
      Quantity{"bias", kInMetres ? "m" : "s",
               kInMetres ? "bias of the clock times the speed of light" : "bias of the clock"},
      Quantity{"drift", kInMetres ? "m/s" : "s/s", "rate of change of the bias"}};

  double sigma_b, sigma_d;

  Clock(double bias_noise, double drift_noise) : sigma_b(bias_noise), sigma_d(drift_noise) {}
  /// Returns the clock of an oscillator with the power-law coefficients h_0, s, and h_-2, 1/s.
  static Clock FromPowerLaw(double h_0, double h_minus_2) {
    constexpr double kPi = 3.14159265358979323846, kSpeedOfLight = 299792458.0;  // m/s
    const double k = kInMetres ? kSpeedOfLight : 1.0;
    return Clock(k * std::sqrt(0.5 * h_0), k * kPi * std::sqrt(2.0 * h_minus_2));
  }
  explicit Clock(Params& p)
      : Clock(
            p.Choice("noise_model", {"densities", "power_law"},
                     "noise given by densities, or by coefficients of the oscillator", 0) == 0
                ? Clock{p.NonNegative("noise.bias", kInMetres ? "m/s^0.5" : "s^0.5",
                                      "root of the spectral density of the noise of the bias"),
                        p.NonNegative("noise.drift", kInMetres ? "m/s^1.5" : "s^-0.5",
                                      "root of the spectral density of the noise of the drift")}
                : FromPowerLaw(p.NonNegative("h_0", "s", "coefficient of white frequency noise"),
                               p.NonNegative("h_minus_2", "1/s",
                                             "coefficient of the random walk of the frequency"))) {}

  template <class T>
  void Step(const T* b, const T* d, const T* w, double dt_s, T* b1, T* d1) const {
    b1[0] = b[0] + dt_s * d[0] + w[0];
    d1[0] = d[0] + w[1];
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    const double s_b = sigma_b * sigma_b, s_d = sigma_d * sigma_d;
    const double q_bb = dt_s * (s_b + s_d * dt_s * dt_s / 3.0);
    if (!(q_bb > 0.0)) return;  // no noise, or dt = 0
    l(0, 0) = std::sqrt(q_bb);
    l(1, 0) = 0.5 * s_d * dt_s * dt_s / l(0, 0);
    // Q_dd - l(1, 0)^2 without cancellation
    l(1, 1) = std::sqrt(s_d * dt_s * dt_s * (s_b + s_d * dt_s * dt_s / 12.0) / q_bb);
  }
};

}  // namespace alidade
