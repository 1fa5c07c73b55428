// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/estimation/problem.h"
#include "alidade/state/state.h"

namespace alidade::internal {

/// Error of a block, e = x_true (-) x in the tangent space at the estimate.
struct BlockError {
  BlockId id;
  const Eigen::VectorXd* error;
  double truth_variance;     ///< variance of each element of the truth
  double prior_sigma = 0.0;  ///< result of LargestPriorSigma
};

/// Smallest sigma of an estimated direction, relative to the largest prior sigma of its block.
/// Rounding errors exceed smaller sigmas.
inline constexpr double kSmallestSigma = 1e-9;

/// NEES e' C^-1 e with its degrees of freedom.
struct Nees {
  double value = 0.0;  ///< NaN if C is singular or not finite
  int dof = 0;         ///< 0 if no block is estimated
};

/// Returns the largest standard deviation of an element of the prior of a block; 0 if the block has
/// no prior covariance.
double LargestPriorSigma(const Problem& problem, BlockId id);

/// Computes the joint NEES of the estimated blocks among `errors`. Metrics defines C = P + T. A
/// direction whose sigma is below kSmallestSigma counts neither in the NEES nor in its degrees of
/// freedom.
Nees JointNees(const State& state, std::span<const BlockError> errors);

}  // namespace alidade::internal
