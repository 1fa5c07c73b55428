// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace alidade {

enum class LossKind {
  kNone,    ///< squared error
  kHuber,   ///< linear beyond the scale
  kCauchy,  ///< logarithmic beyond the scale
};

/// Robust loss rho(d) of the Mahalanobis distance d >= 0 of a residual, with the scale k
/// [Holland1977]. A squared error with the weight w(d) = rho'(d) / d has the same gradient. A
/// measurement with the covariance R therefore acts like a measurement with the covariance R / w.
struct LossFunctions {
  const char* name;  ///< name in configs
  double (*rho)(double d, double k);
  double (*weight)(double d, double k);     ///< w(d), in [0, 1]
  double (*curvature)(double d, double k);  ///< dw / d(d^2) = w'(d) / (2 d), for d > 0
};

/// Functions of all losses, indexed by LossKind.
inline constexpr std::array kLosses = {
    // rho(d) = d^2 / 2,  w(d) = 1
    LossFunctions{"none", [](double d, double) { return 0.5 * d * d; },
                  [](double, double) { return 1.0; }, [](double, double) { return 0.0; }},
    // rho(d) = d^2 / 2 up to k, then k d - k^2 / 2;  w(d) = min(1, k / d)
    LossFunctions{"huber",
                  [](double d, double k) { return d <= k ? 0.5 * d * d : k * (d - 0.5 * k); },
                  [](double d, double k) { return d <= k ? 1.0 : k / d; },
                  [](double d, double k) { return d <= k ? 0.0 : -0.5 * (k / d) / (d * d); }},
    // rho(d) = k^2 / 2 log(1 + d^2 / k^2),  w(d) = 1 / (1 + d^2 / k^2)
    LossFunctions{"cauchy",
                  [](double d, double k) { return 0.5 * k * k * std::log1p((d / k) * (d / k)); },
                  [](double d, double k) { return 1.0 / (1.0 + (d / k) * (d / k)); },
                  [](double d, double k) {
                    const double w = 1.0 / (1.0 + (d / k) * (d / k));
                    return -w * w / (k * k);
                  }},
};

static_assert(kLosses.size() == static_cast<std::size_t>(LossKind::kCauchy) + 1);
/// Returns the functions of a loss.
inline const LossFunctions& FunctionsOf(LossKind kind) {
  return kLosses[static_cast<std::size_t>(kind)];
}
/// Returns `none`, `huber` or `cauchy`.
inline const char* ToString(LossKind kind) { return FunctionsOf(kind).name; }

/// Robust loss with its scale.
struct RobustLoss {
  LossKind kind = LossKind::kNone;
  double scale = 1.0;  ///< k > 0, in standard deviations

  friend bool operator==(const RobustLoss&, const RobustLoss&) = default;
};

/// Returns rho(d), d >= 0.
inline double Rho(const RobustLoss& loss, double d) {
  return FunctionsOf(loss.kind).rho(d, loss.scale);
}
/// Returns w(d), d >= 0.
inline double Weight(const RobustLoss& loss, double d) {
  return FunctionsOf(loss.kind).weight(d, loss.scale);
}

}  // namespace alidade
