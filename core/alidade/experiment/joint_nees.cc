// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/joint_nees.h"

#include <cmath>

#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Computes the NEES in the directions whose sigma is large enough. C is in units of the prior
/// sigmas.
Nees NeesOfUncertainDirections(const Eigen::MatrixXd& c, const Eigen::VectorXd& error) {
  const SymmetricEigen eigen = EigenOf(c);
  Nees nees;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (!(eigen.values[i] > kSmallestSigma * kSmallestSigma)) continue;
    const double along = eigen.vectors.col(i).dot(error);
    nees.value += along * along / eigen.values[i];
    ++nees.dof;
  }
  return nees;
}

}  // namespace

double LargestPriorSigma(const Problem& problem, BlockId id) {
  for (const Prior& prior : problem.priors) {
    if (prior.block != id || prior.covariance.size() == 0) continue;
    return std::sqrt(prior.covariance.diagonal().maxCoeff());
  }
  return 0.0;
}

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
  Eigen::VectorXd joint_error(nees.dof), prior_sigmas(nees.dof);
  int row = 0;
  for (const BlockError& a : errors) {
    if (!is_used(a)) continue;
    joint_error.segment(row, size(a)) = *a.error;
    prior_sigmas.segment(row, size(a)).setConstant(a.prior_sigma);
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
  const bool has_priors = prior_sigmas.minCoeff() > 0.0 && c.allFinite();
  const bool has_exact_directions =
      std::isnan(nees.value) ||
      (c.diagonal().cwiseSqrt().array() <= kSmallestSigma * prior_sigmas.array()).any();
  if (!has_priors || !has_exact_directions) return nees;
  const Eigen::VectorXd scale = prior_sigmas.cwiseInverse();
  return NeesOfUncertainDirections(scale.asDiagonal() * c * scale.asDiagonal(),
                                   scale.cwiseProduct(joint_error));
}

}  // namespace alidade::internal
