// SPDX-License-Identifier: Apache-2.0
#include "frozen_solve.h"

#include <ceres/iteration_callback.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "alidade/base/decompositions.h"
#include "residuals.h"

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

/// phi as least squares, with the same cost, gradient g and Gauss-Newton matrix A = U' U:
///
///   r = (U^-T g, sqrt(2 phi - |U^-T g|^2)),   J = [U; 0]
///
/// Where no Jacobian is asked for, r = (0, sqrt(2 phi)).
class ReducedCost : public ceres::CostFunction {
 public:
  explicit ReducedCost(CondensedRun& run) : run_(run) {
    set_num_residuals(run.inputs() + 1);
    mutable_parameter_block_sizes()->push_back(run.inputs());
  }
  bool Evaluate(const double* const* e, double* residuals, double** jacobians) const override {
    const bool derivatives = jacobians != nullptr && jacobians[0] != nullptr;
    const int n = run_.inputs();
    CondensedRun::Reduced reduced;
    if (!run_.Reduce(e[0], derivatives, reduced)) return false;
    Eigen::Map<Eigen::VectorXd> r(residuals, n);
    r.setZero();
    if (derivatives) {
      const Eigen::LLT<Eigen::MatrixXd> llt(reduced.a);
      if (llt.info() != Eigen::Success) return false;
      r = llt.matrixL().solve(reduced.g);
      Eigen::Map<RowMajor> j(jacobians[0], n + 1, n);
      j.setZero();
      j.topRows(n) = llt.matrixU();
    }
    residuals[n] = std::sqrt(std::max(0.0, 2.0 * reduced.cost - r.squaredNorm()));
    return true;
  }

 private:
  CondensedRun& run_;
};

double CostOf(const CondensedRun& run, const Eigen::VectorXd& e, const Eigen::VectorXd& r) {
  double cost = 0.5 * e.squaredNorm();
  for (const CondensedRun::Part& part : run.parts()) {
    cost += Rho(part.loss, r.segment(part.row, part.size).norm());
  }
  return cost;
}

}  // namespace

bool CostAt(CondensedRun& run, const Eigen::VectorXd& e, double& cost) {
  if (run.has_landmarks()) {
    CondensedRun::Reduced reduced;
    if (!run.Reduce(e.data(), false, reduced)) return false;
    cost = reduced.cost;
    return true;
  }
  Eigen::VectorXd r(run.residuals());
  if (!run.Evaluate(e.data(), r.data(), nullptr)) return false;
  cost = CostOf(run, e, r);
  return true;
}

ceres::Solver::Summary SolveFrozen(CondensedRun& run, Eigen::VectorXd& e, int max_iterations,
                                   const std::function<bool()>& stop) {
  const Eigen::Index n = e.size();
  ceres::Solver::Summary summary;
  if (n == 0) {  // Ceres knows no block of size 0
    const bool defined = CostAt(run, e, summary.final_cost);
    summary.termination_type = defined ? ceres::CONVERGENCE : ceres::FAILURE;
    return summary;
  }
  Residuals residuals(run, e);
  const bool reduced = run.has_landmarks();
  ceres::Problem::Options of_problem;
  if (!reduced) of_problem.evaluation_callback = &residuals;
  ceres::Problem problem(of_problem);
  if (reduced) {
    problem.AddResidualBlock(new ReducedCost(run), nullptr, e.data());
  } else {
    problem.AddResidualBlock(
        new ceres::NormalPrior(Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd::Zero(n)), nullptr,
        e.data());
    residuals.AddTo(problem, e.data());
  }
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
  return summary;
}

bool GaussNewtonAt(CondensedRun& run, const Eigen::VectorXd& e, GaussNewton& at) {
  const Eigen::Index n = e.size(), m = run.residuals();
  if (run.has_landmarks()) {
    CondensedRun::Reduced reduced;
    if (!run.Reduce(e.data(), true, reduced)) return false;
    const Eigen::LLT<Eigen::MatrixXd> llt(reduced.a);
    at.cost = reduced.cost;
    at.u = llt.matrixU();
    at.step = -llt.solve(reduced.g);
    return llt.info() == Eigen::Success || run.Fail("the normal matrix is not positive definite");
  }
  RowMajor j = RowMajor::Identity(n + m, n);
  Eigen::VectorXd r(m), weighted(n + m);
  if (!run.Evaluate(e.data(), r.data(), j.data() + n * n)) return false;
  at.cost = CostOf(run, e, r);
  weighted << e, r;
  for (const CondensedRun::Part& part : run.parts()) {
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
