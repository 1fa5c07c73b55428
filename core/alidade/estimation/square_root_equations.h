// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "alidade/estimation/ekf_equations.h"
#include "alidade/state/workspace.h"

namespace alidade::internal {

/// Relation between the vector u before a step or an update and the vector u' after it:
///
///   u = T u' + C v + c,   v ~ N(0, I)
///
/// SquareRootEquations describe the state as x (+) D u, with u ~ N(0, I) and P = D D'. Each step
/// and update multiplies u, together with the noise, by an orthogonal matrix. T and C are parts of
/// this matrix. A measurement determines c.
struct BackwardStep {
  Eigen::MatrixXd transition;  ///< T
  Eigen::MatrixXd noise;       ///< C; it has no columns if there is no noise v
  Eigen::VectorXd offset;      ///< c
};

/// Equations of the square-root filter, as documented at SquareRootEkf. Uses the Jacobians of
/// EkfEquations, stores a root of P, and computes P from the root.
class SquareRootEquations : public UpdateMethod {
 public:
  /// If `is_recording` is true, each step and update adds a BackwardStep.
  explicit SquareRootEquations(bool is_recording = false) : is_recording_(is_recording) {}

  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<SquareRootEquations>(*this);
  }
  void Begin(FilterState& f) override;
  StepError Step(FilterState& f, double dt_s) override;
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override {
    return ekf_.Predict(f, pending);
  }
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override;
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override;

  const Eigen::MatrixXd* Root() const override { return &root_; }
  /// Returns D: the root L of P, or [B M] in an interval of discrete noise.
  Eigen::MatrixXd Directions(const FilterState& f) const;
  /// Returns the backward steps that were added since the last call.
  std::vector<BackwardStep> ExtractBackwardSteps() { return std::exchange(backward_steps_, {}); }

 private:
  void SetCovariance(FilterState& f) const;
  void RecordStep(FilterState& f, const Workspace::Matrix& reflectors,
                  const Workspace::Vector& factors, bool continues_interval);
  void RecordEndOfInterval(FilterState& f);
  void Record(BackwardStep step);

  /// Square root of R.
  struct NoiseRoot {
    Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt;
    Eigen::MatrixXd root;
  };

  EkfEquations ekf_;
  Eigen::MatrixXd root_;                ///< L
  Eigen::MatrixXd conditional_root_;    ///< B; used in an interval of discrete noise
  std::vector<NoiseRoot> noise_roots_;  ///< by sensor; reused memory
  bool is_recording_;
  std::vector<BackwardStep> backward_steps_;
  Eigen::Index variables_ = 0;  ///< size of u, if the steps are recorded
};

}  // namespace alidade::internal
