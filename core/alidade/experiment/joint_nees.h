// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "alidade/state/state.h"

namespace alidade::internal {

/// The error of a block, e = x_true (-) x in the tangent at the estimate.
struct BlockError {
  BlockId id;
  const Eigen::VectorXd* error;
  double truth_variance;  ///< of each element
};

/// e' C^-1 e and its degrees of freedom.
struct Nees {
  double value = 0.0;  ///< NaN where C is singular or not finite
  int dof = 0;         ///< 0: none of the blocks is estimated
};

/// That of these blocks jointly, without those that are not estimated; C = P + T as in Metrics.
Nees JointNees(const State& state, std::span<const BlockError> errors);

}  // namespace alidade::internal
