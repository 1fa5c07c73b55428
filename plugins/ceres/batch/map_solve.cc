// SPDX-License-Identifier: Apache-2.0
#include "map_solve.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"

namespace alidade::ceres_batch {
namespace {

/// `key (50 here)`
std::string Setting(const char* key, int value) {
  return std::string(key) + " (" + std::to_string(value) + " here)";
}

/// Freezes at e; false where a model is not defined there.
bool CanStart(CondensedRun& run, const Eigen::VectorXd& e) {
  return run.Freeze(e) && CostAt(run, e);
}

}  // namespace

SolveOptions ReadSolveOptions(Params& params) {
  SolveOptions options;
  options.max_iterations = params.Integer("max_iterations", "most iterations of a solve", 1,
                                          1'000'000, options.max_iterations);
  options.max_outer_iterations = params.Integer(
      "max_outer_iterations", "solves, with noise that depends on the state taken anew", 1,
      1'000'000, options.max_outer_iterations);
  options.max_dt_s =
      params.NumberOrNone("max_dt_s", "s", "longer gaps are stepped in equal parts", kPositive)
          .value_or(options.max_dt_s);
  return options;
}

void MapSolve::HeedStop() const {
  if (Stopped()) throw Error(ExitCode::kStopped, "stopped while the batch was solved");
}

void MapSolve::Note(Timestamp timestamp, std::vector<Event>& events) const {
  if (!note_.empty()) events.push_back({timestamp, "not_converged", note_});
}

bool MapSolve::SolveAll(CondensedRun& run, const Trajectory& about, Eigen::VectorXd& e) {
  bool defined = run.Linearised(about, e) && CanStart(run, e);
  if (!defined) {
    e.setZero(run.shape().inputs);
    defined = CanStart(run, e);
  }
  return SolveFrom(run, defined, e);
}

bool MapSolve::SolveAnew(CondensedRun& run, const Trajectory& about, Eigen::VectorXd& e) {
  const RunShape shape = run.shape();
  const Eigen::Index before = e.size();
  e.conservativeResize(shape.inputs);
  e.tail(e.size() - before).setZero();
  const bool old = !shape.has_unit_vector && CanStart(run, e);
  return SolveFrom(run, old || (run.Linearised(about, e) && CanStart(run, e)), e);
}

/// From e, at which Q and R are frozen, where the models are defined there.
bool MapSolve::SolveFrom(CondensedRun& run, bool defined, Eigen::VectorXd& e) {
  note_.clear();
  if (!defined) {
    failed_ = true;
    summary_ = "nowhere to start: " + run.problem();
    return false;
  }
  const std::string solved = Minimise(run, e);
  HeedStop();
  defined = TakeLastStep(run, e);
  summary_ = "cost " + internal::RoundedText(at_.cost, 9) + ", " + solved + summary_;
  return FailUnless(defined, run);
}

bool MapSolve::FailUnless(bool defined, const CondensedRun& run) {
  if (defined) return true;
  failed_ = true;
  summary_ += "; then " + run.problem();
  return false;
}

/// Until Q and R settle. How it went; in summary_, why it failed.
std::string MapSolve::Minimise(CondensedRun& run, Eigen::VectorXd& e) {
  constexpr double kSettled = 1e-9;
  int iterations = 0, outer = 0;
  bool settled = false;
  summary_ = "the noise that depends on the state did not settle; a larger " +
             Setting("max_outer_iterations", options_.max_outer_iterations) + " may do";
  do {
    HeedStop();
    const ceres::Solver::Summary summary =
        SolveFrozen(run, e, options_.max_iterations, [this] { return Stopped(); });
    HeedStop();
    iterations += std::max(0, static_cast<int>(summary.iterations.size()) - 1);
    ++outer;
    at_.cost = summary.final_cost;
    failed_ = summary.termination_type != ceres::CONVERGENCE || !std::isfinite(summary.final_cost);
    if (failed_) summary_ = WhyNot(summary, run);
    if (!failed_ && run.shape().robust()) iterations += IterateWeights(run, e);
    if (failed_) break;
    const std::optional<double> change = run.Freeze(e);
    if (!change) {
      summary_ = run.problem();
      break;
    }
    settled = *change <= kSettled;
  } while (!settled && outer < options_.max_outer_iterations);
  failed_ = failed_ || !settled;
  if (!failed_) summary_.clear();
  return std::to_string(iterations) + " iterations in " + std::to_string(outer) +
         (outer == 1 ? " solve: " : " solves: ");
}

std::string MapSolve::WhyNot(const ceres::Solver::Summary& summary, const CondensedRun& run) const {
  if (!std::isfinite(summary.final_cost)) {
    return "not converged, the cost is not finite: a measurement lies too far out; `use: "
           "{accepted_by: FILTER}` leaves out what a filter gates";
  }
  const bool by_count = summary.termination_type == ceres::NO_CONVERGENCE;
  return "not converged, " + summary.message +
         (by_count ? " A larger " + Setting("max_iterations", options_.max_iterations) + " may do."
                   : "") +
         (run.problem().empty() ? "" : " A step was refused: " + run.problem());
}

/// U at e, and the Gauss-Newton step that it gives: Ceres stops before the last one. A solver that
/// stopped where this step, |U step| sigmas, is long was not led down by the Jacobian that it was
/// given. False where GaussNewtonAt is, or the step leads to where a model is not defined.
bool MapSolve::TakeLastStep(CondensedRun& run, Eigen::VectorXd& e) {
  constexpr double kLong = 1e-3, kRounding = 1e-6;
  if (!GaussNewtonAt(run, e, at_)) return false;
  if (failed_) return true;
  failed_ = !((at_.u * at_.step).norm() <= kLong + kRounding * std::sqrt(2.0 * at_.cost));
  if (failed_) {
    summary_ =
        "not converged: no step lowers the cost although the gradient is not zero; check the "
        "models' Jacobians with alidade check";
    return true;
  }
  summary_ = "converged";
  e += at_.step;
  return !run.shape().has_landmarks || CostAt(run, e);
}

/// Iteratively reweighted least squares (IRLS) converges linearly where the squared error does so
/// quadratically: what is left below Ceres' tolerances counts. A step that raises the cost is not
/// taken, and ends it. How many steps it took.
int MapSolve::IterateWeights(CondensedRun& run, Eigen::VectorXd& e) {
  // Of inputs whose sigma is 1; with landmarks a step takes longer.
  const double settled = run.shape().has_landmarks ? 1e-6 : 1e-10;
  constexpr double kRounding = 1e-9;  // of the cost
  constexpr double kTells = 1e-8;     // sigma
  GaussNewton next;
  note_.clear();
  if (!GaussNewtonAt(run, e, at_)) return 0;
  int steps = 0;
  for (bool lower = true; lower && at_.step.norm() > settled;) {
    HeedStop();
    const bool spent = steps == options_.max_iterations;
    const Eigen::VectorXd moved = e + at_.step;
    const bool defined = spent || GaussNewtonAt(run, moved, next);
    lower = !spent && defined && next.cost <= at_.cost * (1.0 + kRounding);
    const double left = (at_.u * at_.step).norm();
    if (lower) {
      e = moved;
      std::swap(at_, next);
      ++steps;
    } else if (left > kTells) {
      note_ = "the weights of the losses did not settle in " + std::to_string(steps) +
              " steps: the next one is " + internal::RoundedText(left, 3) + " sigma long; " +
              (spent ? "a larger " + Setting("max_iterations", options_.max_iterations) + " may do"
               : defined ? "it does not lower the cost"
                         : "then " + run.problem());
    }
  }
  return steps;
}

}  // namespace alidade::ceres_batch
