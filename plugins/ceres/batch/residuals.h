// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/problem.h>

#include <Eigen/Core>

#include "condensed_run.h"
#include "plugins/ceres/loss.h"

namespace alidade::ceres_batch {

/// r and dr/de of a condensed run at e, evaluated once for all its parts.
class Residuals : public ceres::EvaluationCallback {
 public:
  /// Both must outlive it; Ceres puts the point to evaluate at into `e`.
  Residuals(const CondensedRun& run, const Eigen::VectorXd& e)
      : run_(run), e_(e), r_(run.residuals()) {}

  void PrepareForEvaluation(bool jacobians, bool new_point) override {
    if (!new_point && (has_jacobian_ || !jacobians)) return;
    if (jacobians) j_.resize(r_.size(), e_.size());
    good_ = run_.Evaluate(e_.data(), r_.data(), jacobians ? j_.data() : nullptr);
    has_jacobian_ = jacobians;
  }

  /// Adds all parts to the problem, each below its loss. `e` is the data of the constructor's.
  void AddTo(ceres::Problem& problem, double* e) const {
    for (const CondensedRun::Part& part : run_.parts()) {
      const bool robust = part.loss.kind != LossKind::kNone;
      problem.AddResidualBlock(new Rows(*this, part), robust ? new Loss(part.loss) : nullptr, e);
    }
  }

 private:
  /// Those of one part.
  class Rows : public ceres::CostFunction {
   public:
    Rows(const Residuals& all, const CondensedRun::Part& part) : all_(all), row_(part.row) {
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

  const CondensedRun& run_;
  const Eigen::VectorXd& e_;
  Eigen::VectorXd r_;
  RowMajor j_;
  bool good_ = false, has_jacobian_ = false;
};

}  // namespace alidade::ceres_batch
