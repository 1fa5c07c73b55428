// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/solver.h>

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "condensed_run.h"

/// The least squares problem of a CondensedRun whose Q and R stand where they were frozen.
namespace alidade::ceres_batch {

/// phi(e) = |e|^2 / 2 + sum_i rho_i(|r_i(e)|), the landmarks where they cost least. None where a
/// model is not defined.
std::optional<double> CostAt(CondensedRun& run, const Eigen::VectorXd& e);
/// Minimises phi from e, until `stop` is true. Where there are no inputs it converges at once.
ceres::Solver::Summary SolveFrozen(CondensedRun& run, Eigen::VectorXd& e, int max_iterations,
                                   const std::function<bool()>& stop);
/// phi about e, with the weights of robust losses as they are there.
struct GaussNewton {
  double cost = 0.0;     ///< phi(e)
  Eigen::MatrixXd u;     ///< U, N x N, upper, with Cov(e) = (U'U)^-1
  Eigen::VectorXd step;  ///< -(U'U)^-1 grad phi
};
/// False, with `at` as it was, where a model is not defined or U'U is singular.
bool GaussNewtonAt(CondensedRun& run, const Eigen::VectorXd& e, GaussNewton& at);

}  // namespace alidade::ceres_batch
