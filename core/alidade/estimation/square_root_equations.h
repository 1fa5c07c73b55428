// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "alidade/estimation/ekf_equations.h"
#include "alidade/state/workspace.h"

namespace alidade::internal {

/// Relation between the vector u before a step or an update and the vector u' after it. Q is
/// orthogonal, a product of reflections (reflections.h). A dot is a part that is not used.
///
///   step     [.; u; .] = Q [u'; v],   v ~ N(0, I)
///   update   [.; u] = Q [y; u'],      y = Ls^-1 r
///
/// SquareRootEquations describe the state as x (+) D u, with u ~ N(0, I) and P = D D'. Each step
/// and update multiplies u, together with the noise, by Q.
struct BackwardStep {
  /// Column k contains reflection k. Update: of y_k and u'. Step: of the last elements of [u'; v],
  /// one for each row of the matrix, but only of those from row k on.
  Eigen::MatrixXd reflectors;
  Eigen::VectorXd y;   ///< y; empty in a step
  Eigen::Index noise;  ///< number of elements of v
  Eigen::Index first;  ///< number of elements before u in [.; u; .]
  Eigen::Index size;   ///< number of elements of u
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

  Eigen::MatrixXd Root(const FilterState& f) const override;
  const std::vector<BackwardStep>& backward_steps() const { return backward_steps_; }

 private:
  void SetCovariance(FilterState& f) const;
  Workspace::Matrix TriangulariseRoot(FilterState& f, Workspace::Matrix& reflectors) const;
  void Record(const ConstMatrix& reflectors, const Eigen::Ref<const Eigen::VectorXd>& y,
              Eigen::Index noise, Eigen::Index first, Eigen::Index size);

  EkfEquations ekf_;
  Eigen::MatrixXd root_;        ///< L, or B in an interval of discrete noise
  bool is_triangular_ = false;  ///< whether root_ is lower triangular
  bool is_recording_;
  std::vector<BackwardStep> backward_steps_;
  Eigen::Index variables_ = 0;  ///< size of u: that of w, if it is a part of u, plus that of x
};

}  // namespace alidade::internal
