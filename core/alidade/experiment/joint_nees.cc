// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/joint_nees.h"

#include "alidade/state/dense_algebra.h"

namespace alidade::internal {

Nees JointNees(const State& state, std::span<const BlockError> errors) {
  const auto is_used = [&](const BlockError& error) {
    const Block& block = state.layout()[error.id];
    return block.present && block.status == BlockStatus::kEstimated;
  };
  const auto size = [&](const BlockError& error) {
    return state.layout()[error.id].geometry().tangent;
  };
  Nees nees;
  for (const BlockError& e : errors) nees.dof += is_used(e) ? size(e) : 0;
  if (nees.dof == 0) return nees;
  Eigen::MatrixXd c(nees.dof, nees.dof);
  Eigen::VectorXd joint_error(nees.dof);
  int row = 0;
  for (const BlockError& a : errors) {
    if (!is_used(a)) continue;
    joint_error.segment(row, size(a)) = *a.error;
    int column = 0;
    for (const BlockError& b : errors) {
      if (!is_used(b)) continue;
      c.block(row, column, size(a), size(b)) =
          state.covariance().Block(state.layout()[a.id].tangent_offset, size(a),
                                   state.layout()[b.id].tangent_offset, size(b));
      column += size(b);
    }
    c.diagonal().segment(row, size(a)).array() += a.truth_variance;
    row += size(a);
  }
  nees.value = SquaredMahalanobis(c, joint_error);
  return nees;
}

}  // namespace alidade::internal
