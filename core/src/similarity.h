// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

#include "alidade/evaluate.h"

/// The similarity that brings points p, columns of `from`, nearest to q, those of `to`: s R p + t
/// with sum |q - s R p - t|^2 least [Umeyama1991].
namespace alidade::internal {

/// Whether p and q of these variances determine s > 0. s sqrt(var p / var q) is their correlation;
/// one of 1e-9 is rounding. Points on a line determine s, and what is left, but not the turn about
/// the line.
inline bool DeterminesScale(double scale, double variance, double to_variance) {
  constexpr double kLeastCorrelation = 1e-9;
  return variance > 0.0 && to_variance > 0.0 &&
         scale * std::sqrt(variance / to_variance) > kLeastCorrelation;
}

/// Nothing of fewer than three points, and where DeterminesScale says no.
std::optional<Similarity> FindSimilarity(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);

}  // namespace alidade::internal
