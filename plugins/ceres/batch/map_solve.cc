// SPDX-License-Identifier: Apache-2.0
#include "map_solve.h"

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/iteration_callback.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/state/dense_algebra.h"
#include "plugins/ceres/loss.h"

namespace alidade::ceres_batch {
namespace {

// The least squares problem of a run whose Q and R stand where they were frozen.

/// Ends a solve once `stop` is true.
class StopCallback : public ceres::IterationCallback {
 public:
  explicit StopCallback(std::function<bool()> stop) : stop_(std::move(stop)) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return stop_() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  std::function<bool()> stop_;
};

/// What Ceres minimises, evaluated once for all its parts: e itself, and r and dr/de of a run. With
/// landmarks one part, with the cost phi, its gradient g and its Gauss-Newton matrix A = U' U:
///
///   r = (U^-T g, sqrt(2 phi - |U^-T g|^2)),   J = [U; 0]
///
/// Where no Jacobian is asked for, r = (0, sqrt(2 phi)).
class Residuals : public ceres::EvaluationCallback {
 public:
  /// Both must outlive it; Ceres puts the point to evaluate at into `e`.
  Residuals(CondensedRun& run, Eigen::VectorXd& e)
      : run_(run),
        e_(e),
        reduced_(run.shape().has_landmarks),
        r_(reduced_ ? e.size() + 1 : run.shape().residuals) {}

  void PrepareForEvaluation(bool jacobians, bool /*new_point*/) override {
    if (jacobians) j_.resize(r_.size(), e_.size());
    good_ = reduced_ ? Reduce(jacobians)
                     : run_.Evaluate(e_, r_.data(), jacobians ? j_.data() : nullptr);
  }

  /// Adds all parts to the problem, each below its loss.
  void AddTo(ceres::Problem& problem) {
    const int n = static_cast<int>(e_.size());
    if (reduced_) {
      problem.AddResidualBlock(new Rows(*this, {0, n + 1, {}}), nullptr, e_.data());
      return;
    }
    problem.AddResidualBlock(
        new ceres::NormalPrior(Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd::Zero(n)), nullptr,
        e_.data());
    for (const Part& part : run_.shape().parts) {
      const bool robust = part.loss.kind != LossKind::kNone;
      problem.AddResidualBlock(new Rows(*this, part), robust ? new Loss(part.loss) : nullptr,
                               e_.data());
    }
  }

 private:
  /// Those of one part.
  class Rows : public ceres::CostFunction {
   public:
    Rows(const Residuals& all, const Part& part) : all_(all), row_(part.row) {
      set_num_residuals(part.size);
      mutable_parameter_block_sizes()->push_back(static_cast<int>(all.e_.size()));
    }
    bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
      if (!all_.good_) return false;
      const int size = num_residuals();
      Eigen::Map<Eigen::VectorXd>(residuals, size) = all_.r_.segment(row_, size);
      if (jacobians == nullptr || jacobians[0] == nullptr) return true;
      Eigen::Map<RowMajor>(jacobians[0], size, all_.e_.size()) = all_.j_.middleRows(row_, size);
      return true;
    }

   private:
    const Residuals& all_;
    int row_;
  };

  bool Reduce(bool jacobians) {
    const Eigen::Index n = e_.size();
    Reduced reduced;
    if (!run_.Reduce(e_, jacobians, reduced)) return false;
    r_.setZero();
    if (jacobians) {
      r_.head(n) = reduced.llt.matrixL().solve(reduced.g);
      j_.setZero();
      j_.topRows(n) = reduced.llt.matrixU();
    }
    r_[n] = std::sqrt(std::max(0.0, 2.0 * reduced.cost - r_.head(n).squaredNorm()));
    return true;
  }

  CondensedRun& run_;
  Eigen::VectorXd& e_;
  bool reduced_;
  Eigen::VectorXd r_;
  RowMajor j_;
  bool good_ = false;
};

double CostOf(const CondensedRun& run, const Eigen::VectorXd& e, const Eigen::VectorXd& r) {
  double cost = 0.5 * e.squaredNorm();
  for (const Part& part : run.shape().parts) {
    cost += Rho(part.loss, r.segment(part.row, part.size).norm());
  }
  return cost;
}

/// phi(e) = |e|^2 / 2 + sum_i rho_i(|r_i(e)|), the landmarks where they cost least. None where a
/// model is not defined.
std::optional<double> CostAt(CondensedRun& run, const Eigen::VectorXd& e) {
  const RunShape shape = run.shape();
  if (shape.has_landmarks) {
    Reduced reduced;
    if (!run.Reduce(e, false, reduced)) return {};
    return reduced.cost;
  }
  Eigen::VectorXd r(shape.residuals);
  if (!run.Evaluate(e, r.data(), nullptr)) return {};
  return CostOf(run, e, r);
}

/// Minimises phi from e, until `stop` is true. Where there are no inputs it converges at once.
ceres::Solver::Summary SolveFrozen(CondensedRun& run, Eigen::VectorXd& e, int max_iterations,
                                   const std::function<bool()>& stop) {
  ceres::Solver::Summary summary;
  if (e.size() == 0) {  // Ceres knows no block of size 0
    const std::optional<double> cost = CostAt(run, e);
    summary.termination_type = cost ? ceres::CONVERGENCE : ceres::FAILURE;
    summary.final_cost = cost.value_or(summary.final_cost);
    return summary;
  }
  const bool reduced = run.shape().has_landmarks;
  const Eigen::VectorXd start = e;
  Residuals residuals(run, e);
  ceres::Problem::Options of_problem;
  of_problem.evaluation_callback = &residuals;
  ceres::Problem problem(of_problem);
  residuals.AddTo(problem);
  ceres::Solver::Options options;
  options.linear_solver_type = reduced ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
  options.max_num_iterations = max_iterations;
  options.initial_trust_region_radius = 1e8;  // Gauss-Newton as long as the cost falls
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.num_threads = 1;
  StopCallback callback(stop);
  options.callbacks.push_back(&callback);
  options.logging_type = ceres::SILENT;
  ceres::Solve(options, &problem, &summary);
  // Where it fails, e is the point evaluated last.
  if (!summary.IsSolutionUsable()) e = start;
  return summary;
}

/// False, with `result` as it was, where a model is not defined or U'U is singular.
bool GaussNewtonAt(CondensedRun& run, const Eigen::VectorXd& e, GaussNewton& result) {
  const RunShape shape = run.shape();
  const Eigen::Index n = e.size(), m = shape.residuals;
  if (shape.has_landmarks) {
    Reduced reduced;
    if (!run.Reduce(e, true, reduced)) return false;
    result.cost = reduced.cost;
    result.u = reduced.llt.matrixU();
    result.step = -reduced.llt.solve(reduced.g);
    return true;
  }
  RowMajor j = RowMajor::Identity(n + m, n);
  Eigen::VectorXd r(m), weighted(n + m);
  if (!run.Evaluate(e, r.data(), j.data() + n * n)) return false;
  result.cost = CostOf(run, e, r);
  weighted << e, r;
  for (const Part& part : shape.parts) {
    if (part.loss.kind == LossKind::kNone) continue;
    const double root = std::sqrt(Weight(part.loss, r.segment(part.row, part.size).norm()));
    weighted.segment(n + part.row, part.size) *= root;
    j.middleRows(n + part.row, part.size) *= root;
  }
  internal::LeastSquares found = internal::SolveLeastSquares(j, weighted);
  result.u = std::move(found.r);
  result.step = -found.x;
  return true;
}

// What makes them settle.

/// Freezes at e; false where a model is not defined there.
bool CanStart(CondensedRun& run, const Eigen::VectorXd& e) {
  return run.Freeze(e) && CostAt(run, e);
}

}  // namespace

std::string SettingText(const char* key, int value) {
  return std::string(key) + " (" + std::to_string(value) + " here)";
}

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
  if (!note_.empty()) events.push_back({timestamp, EventKind::kNotConverged, note_});
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
             SettingText("max_outer_iterations", options_.max_outer_iterations) + " may do";
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
    if (!failed_ && run.shape().robust) iterations += IterateWeights(run, e);
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
         (by_count
              ? " A larger " + SettingText("max_iterations", options_.max_iterations) + " may do."
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
  constexpr double kSettled = 1e-10;  // of inputs whose sigma is 1
  constexpr double kRounding = 1e-9;  // of the cost
  constexpr double kTells = 1e-8;     // sigma
  GaussNewton next;
  note_.clear();
  if (!GaussNewtonAt(run, e, at_)) return 0;
  int steps = 0;
  for (bool lower = true; lower && at_.step.norm() > kSettled;) {
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
      note_ =
          "the weights of the losses did not settle in " + std::to_string(steps) +
          " steps: the next one is " + internal::RoundedText(left, 3) + " sigma long; " +
          (spent ? "a larger " + SettingText("max_iterations", options_.max_iterations) + " may do"
           : defined ? "it does not lower the cost"
                     : "then " + run.problem());
    }
  }
  return steps;
}

}  // namespace alidade::ceres_batch
