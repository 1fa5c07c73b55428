// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/state.h"

namespace alidade::internal {

/// Error of a block, e = x_true (-) x in the tangent space at the estimate.
struct BlockError {
  BlockId id;
  const Eigen::VectorXd* error;
  double truth_variance;  ///< variance of each element of the truth
};

/// NEES e' C^-1 e with its degrees of freedom.
struct Nees {
  double value = 0.0;  ///< NaN if C is singular or not finite
  int dof = 0;         ///< 0 if no block is estimated
};

/// Computes the joint NEES of the estimated blocks among `errors`. Metrics defines C = P + T.
Nees JointNees(const State& state, std::span<const BlockError> errors);

}  // namespace alidade::internal
