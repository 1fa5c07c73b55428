// SPDX-License-Identifier: Apache-2.0
#include "map_solve.h"

#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

#include "alidade/error.h"
#include "frozen_solve.h"

namespace alidade::ceres_batch {
namespace {

/// `key (50 here)`
std::string Setting(const char* key, int value) {
  return std::string(key) + " (" + std::to_string(value) + " here)";
}

}  // namespace

void MapSolve::HeedStop() const {
  if (Stopped()) throw Error(ExitCode::kStopped, "stopped while the batch was solved");
}

bool MapSolve::CanStart(Trajectory& trajectory, const Eigen::VectorXd& e) {
  return trajectory.Freeze(e.data()) && IsDefined(trajectory, e);
}

void MapSolve::Solve(Trajectory& trajectory, Eigen::VectorXd& e) {
  constexpr double kSettled = 1e-9;
  int iterations = 0, outer = 0;
  bool settled = false;
  std::string why = "the noise that depends on the state did not settle; a larger " +
                    Setting("max_outer_iterations", options_.max_outer_iterations) + " may do";
  ceres::Solver::Summary summary;
  do {
    HeedStop();
    summary = SolveFrozen(trajectory, e, options_.max_iterations, [this] { return Stopped(); });
    HeedStop();
    iterations += static_cast<int>(summary.iterations.size()) - 1;
    ++outer;
    failed_ = summary.termination_type != ceres::CONVERGENCE || !std::isfinite(summary.final_cost);
    if (failed_) why = WhyNot(summary);
    if (!failed_ && trajectory.robust()) iterations += Reweight(trajectory, e);
    if (failed_) break;
    if (!trajectory.Freeze(e.data())) {
      why = trajectory.problem();
      break;
    }
    settled = trajectory.change() <= kSettled;
  } while (!settled && outer < options_.max_outer_iterations);
  failed_ = failed_ || !settled;
  cost_ = summary.final_cost;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "cost " << std::setprecision(9) << cost_ << ", " << iterations << " iterations in "
       << outer << (outer == 1 ? " solve: " : " solves: ");
  summary_ = text.str();
  if (failed_) summary_ += why;
}

std::string MapSolve::WhyNot(const ceres::Solver::Summary& summary) const {
  if (!std::isfinite(summary.final_cost)) {
    return "not converged, the cost is not finite: a measurement lies too far out; `use: "
           "{accepted_by: FILTER}` leaves out what a filter gates";
  }
  const bool by_count = summary.termination_type == ceres::NO_CONVERGENCE;
  return "not converged, " + summary.message +
         (by_count ? " A larger " + Setting("max_iterations", options_.max_iterations) + " may do."
                   : "");
}

bool MapSolve::Covariances(Trajectory& trajectory, Eigen::VectorXd& e) {
  constexpr double kLong = 1e-3, kRounding = 1e-6;
  Eigen::VectorXd step;
  HeedStop();
  if (!GaussNewton(trajectory, e, u_, step)) return false;
  if (failed_) return true;
  failed_ = !((u_ * step).norm() <= kLong + kRounding * std::sqrt(2.0 * cost_));
  if (failed_) {
    summary_ +=
        "not converged: no step lowers the cost although the gradient is not zero; check the "
        "models' Jacobians with alidade check";
    return true;
  }
  summary_ += "converged";
  e += step;
  return !trajectory.has_landmarks() || IsDefined(trajectory, e);
}

/// Reweighted least squares converges linearly where the squared error does so quadratically: what
/// is left below Ceres' tolerances counts. How many steps it took.
int MapSolve::Reweight(Trajectory& trajectory, Eigen::VectorXd& e) {
  // Of inputs whose sigma is 1; with landmarks a step takes longer.
  const double settled = trajectory.has_landmarks() ? 1e-6 : 1e-10;
  Eigen::VectorXd step;
  int steps = 0;
  do {
    HeedStop();
    if (!GaussNewton(trajectory, e, u_, step)) return steps;
    e += step;
    ++steps;
  } while (step.norm() > settled && steps < options_.max_iterations);
  return steps;
}

}  // namespace alidade::ceres_batch
