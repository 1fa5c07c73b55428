// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace alidade {

enum class LossKind {
  kNone,    ///< squared error
  kHuber,   ///< linear beyond the scale
  kCauchy,  ///< logarithmic beyond the scale
};

/// A robust loss on the Mahalanobis distance d >= 0 of a residual [Holland1977].
///
///   none      rho(d) = d^2 / 2                               w(d) = 1
///   Huber     rho(d) = d^2 / 2 up to k, k d - k^2 / 2 after  w(d) = min(1, k / d)
///   Cauchy    rho(d) = k^2 / 2 log(1 + d^2 / k^2)            w(d) = 1 / (1 + d^2 / k^2)
///
/// w(d) = rho'(d) / d is the weight of the squared error that has the same gradient: a measurement
/// with covariance R counts like one with R / w.
struct RobustLoss {
  LossKind kind = LossKind::kNone;
  double scale = 1.0;  ///< k > 0, in standard deviations

  friend bool operator==(const RobustLoss&, const RobustLoss&) = default;
};

/// rho(d), d >= 0; half the squared error where there is no loss.
inline double Rho(const RobustLoss& loss, double d) {
  const double k = loss.scale;
  switch (loss.kind) {
    case LossKind::kHuber:
      return d <= k ? 0.5 * d * d : k * (d - 0.5 * k);
    case LossKind::kCauchy:
      return 0.5 * k * k * std::log1p((d / k) * (d / k));
    case LossKind::kNone:
      break;
  }
  return 0.5 * d * d;
}

/// w(d) = rho'(d) / d, in (0, 1], or 0 where that underflows; d >= 0.
inline double Weight(const RobustLoss& loss, double d) {
  const double k = loss.scale;
  switch (loss.kind) {
    case LossKind::kHuber:
      return d <= k ? 1.0 : k / d;
    case LossKind::kCauchy:
      return 1.0 / (1.0 + (d / k) * (d / k));
    case LossKind::kNone:
      break;
  }
  return 1.0;
}

/// `none`, `huber`, `cauchy`.
inline const char* ToString(LossKind kind) {
  constexpr const char* kNames[] = {"none", "huber", "cauchy"};
  return kNames[static_cast<int>(kind)];
}

}  // namespace alidade
