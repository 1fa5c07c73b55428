// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/solver.h>

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "alidade/model/params.h"
#include "condensed_run.h"

namespace alidade::ceres_batch {

/// Which way a batch is solved; automatic: sparse, but dense where there are few inputs.
enum class SolverKind { kAutomatic, kSparse, kDense };

struct SolveOptions {
  SolverKind solver = SolverKind::kDense;
  int max_iterations = 500;
  int max_outer_iterations = 20;
  double max_dt_s = std::numeric_limits<double>::infinity();  ///< of a step of the motion
};
SolveOptions ReadSolveOptions(Params& params);
/// `key (50 here)`
std::string SettingText(const char* key, int value);

/// phi(e) = |e|^2 / 2 + sum_i rho_i(|r_i(e)|) of a CondensedRun whose Q and R stand where they were
/// frozen, about e, with the weights of robust losses as they are there.
struct GaussNewton {
  double cost = 0.0;     ///< phi(e)
  Eigen::MatrixXd u;     ///< U, N x N, upper, with Cov(e) = (U'U)^-1
  Eigen::VectorXd step;  ///< -(U'U)^-1 grad phi
};

/// The maximum a posteriori of a CondensedRun: Q and R that depend on the state are frozen, the
/// problem is solved, and so on until they settle.
///
/// With [I; sqrt(w) J_r_e] = Q U at the solution, where w are the weights of robust losses, 1
/// without, Cov(e) = (U'U)^-1 and P_k = (U^-T S_k')'(U^-T S_k').
class MapSolve {
 public:
  explicit MapSolve(const SolveOptions& options) : options_(options) {}

  /// Where `stop` is true, a solve ends by an Error of kStopped.
  void StopWhen(std::function<bool()> stop) { stop_ = std::move(stop); }
  /// Solves from the problem linearised about `about`, or where that leaves the domain of a model,
  /// from e = 0. False, and summary(), where there are no estimates.
  bool SolveAll(CondensedRun& run, const Trajectory& about, Eigen::VectorXd& e);
  /// Solves from e, the solution before the last frame came, and new inputs at their mean. Where
  /// that leaves the domain of a model, and with unit vectors, from the problem linearised about
  /// `about`. False, and summary(), where there are no estimates.
  bool SolveAnew(CondensedRun& run, const Trajectory& about, Eigen::VectorXd& e);
  /// Returns `defined`, whether the estimates of the solution are. Where not, it has failed.
  bool FailUnless(bool defined, const CondensedRun& run);

  bool failed() const { return failed_; }  ///< not converged, not settled, or not defined
  const std::string& summary() const { return summary_; }
  const Eigen::MatrixXd& u() const { return at_.u; }
  /// The event `not_converged` where the weights of robust losses did not settle.
  void Note(Timestamp timestamp, std::vector<Event>& events) const;
  void HeedStop() const;

 private:
  bool SolveFrom(CondensedRun& run, bool defined, Eigen::VectorXd& e);
  std::string Minimise(CondensedRun& run, Eigen::VectorXd& e);
  int IterateWeights(CondensedRun& run, Eigen::VectorXd& e);
  bool TakeLastStep(CondensedRun& run, Eigen::VectorXd& e);
  std::string WhyNot(const ceres::Solver::Summary& summary, const CondensedRun& run) const;
  bool Stopped() const { return stop_ && stop_(); }

  SolveOptions options_;
  std::function<bool()> stop_;
  GaussNewton at_;  ///< at the solution
  std::string summary_, note_;
  bool failed_ = false;
};

}  // namespace alidade::ceres_batch
