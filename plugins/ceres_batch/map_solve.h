// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/solver.h>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <utility>

#include "trajectory.h"

namespace alidade::ceres_batch {

/// The maximum a posteriori of a Trajectory: Q and R that depend on the state are frozen, the
/// problem is solved, and so on until they settle.
///
/// With [I; sqrt(w) J_r_e] = Q U at the solution, where w are the weights of robust losses, 1
/// without, Cov(e) = (U'U)^-1 and P_k = (U^-T S_k')'(U^-T S_k').
class MapSolve {
 public:
  struct Options {
    int max_iterations = 50;
    int max_outer_iterations = 20;
  };
  explicit MapSolve(const Options& options) : options_(options) {}

  /// Where `stop` is true, a solve ends by an Error of kStopped.
  void StopWhen(std::function<bool()> stop) { stop_ = std::move(stop); }
  /// Freezes at e; false where a model is not defined there.
  static bool CanStart(Trajectory& trajectory, const Eigen::VectorXd& e);
  /// Solves from e, at which Q and R are frozen, until they settle.
  void Solve(Trajectory& trajectory, Eigen::VectorXd& e);
  /// U at e, and the Gauss-Newton step that it gives: Ceres stops before the last one. A solver
  /// that stopped where this step, |U step| sigmas, is long was not led down by the Jacobian that
  /// it was given. False where a model is not defined.
  bool Covariances(Trajectory& trajectory, Eigen::VectorXd& e);
  /// y = U^-T S' of a point, as Trajectory::Put takes it.
  Eigen::MatrixXd Whitened(const Trajectory::Point& point) const {
    return u_.transpose().triangularView<Eigen::Lower>().solve(point.s.transpose());
  }

  bool failed() const { return failed_; }  ///< not converged, or not settled
  const std::string& summary() const { return summary_; }
  const Eigen::MatrixXd& u() const { return u_; }
  void HeedStop() const;

 private:
  int Reweight(Trajectory& trajectory, Eigen::VectorXd& e);
  std::string WhyNot(const ceres::Solver::Summary& summary) const;
  bool Stopped() const { return stop_ && stop_(); }

  Options options_;
  std::function<bool()> stop_;
  Eigen::MatrixXd u_;
  std::string summary_;
  double cost_ = 0.0;  ///< of the last solve
  bool failed_ = false;
};

}  // namespace alidade::ceres_batch
