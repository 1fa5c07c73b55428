// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/solver.h>

#include <Eigen/Core>
#include <functional>

#include "trajectory.h"

/// The least squares problem of a Trajectory whose Q and R stand where they were frozen.
namespace alidade::ceres_batch {

/// Whether all models are defined at e.
bool IsDefined(Trajectory& trajectory, const Eigen::VectorXd& e);
/// Minimises over e from where it is, until `stop` is true.
ceres::Solver::Summary SolveFrozen(Trajectory& trajectory, Eigen::VectorXd& e, int max_iterations,
                                   const std::function<bool()>& stop);
/// U (N x N, upper) with Cov(e) = (U'U)^-1, and the step -(U'U)^-1 J' r, of the weighted problem.
/// False where a model is not defined.
bool GaussNewton(Trajectory& trajectory, const Eigen::VectorXd& e, Eigen::MatrixXd& u,
                 Eigen::VectorXd& step);

}  // namespace alidade::ceres_batch
