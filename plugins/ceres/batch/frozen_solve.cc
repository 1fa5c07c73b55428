// SPDX-License-Identifier: Apache-2.0
#include "frozen_solve.h"

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/iteration_callback.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>

#include <algorithm>
#include <cmath>

#include "alidade/base/decompositions.h"
#include "plugins/ceres/loss.h"

namespace alidade::ceres_batch {
namespace {

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

}  // namespace

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

bool GaussNewtonAt(CondensedRun& run, const Eigen::VectorXd& e, GaussNewton& at) {
  const RunShape shape = run.shape();
  const Eigen::Index n = e.size(), m = shape.residuals;
  if (shape.has_landmarks) {
    Reduced reduced;
    if (!run.Reduce(e, true, reduced)) return false;
    at.cost = reduced.cost;
    at.u = reduced.llt.matrixU();
    at.step = -reduced.llt.solve(reduced.g);
    return true;
  }
  RowMajor j = RowMajor::Identity(n + m, n);
  Eigen::VectorXd r(m), weighted(n + m);
  if (!run.Evaluate(e, r.data(), j.data() + n * n)) return false;
  at.cost = CostOf(run, e, r);
  weighted << e, r;
  for (const Part& part : shape.parts) {
    if (part.loss.kind == LossKind::kNone) continue;
    const double root = std::sqrt(Weight(part.loss, r.segment(part.row, part.size).norm()));
    weighted.segment(n + part.row, part.size) *= root;
    j.middleRows(n + part.row, part.size) *= root;
  }
  internal::LeastSquares found = internal::SolveLeastSquares(j, weighted);
  at.u = std::move(found.r);
  at.step = -found.x;
  return true;
}

}  // namespace alidade::ceres_batch
