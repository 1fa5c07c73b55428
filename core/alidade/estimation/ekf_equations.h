// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "alidade/estimation/update_method.h"

namespace alidade::internal {

/// Equations of the extended Kalman filter; the comment on Ekf states them. P is a dense matrix.
class EkfEquations : public UpdateMethod {
 public:
  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<EkfEquations>(*this);
  }
  StepError Step(FilterState& f, double dt_s) override;
  void BeginUpdate(FilterState& f, int capacity) override;
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override;
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override;
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override {
    return CorrectBy(f, rows, nullptr);
  }

  /// Corrects P as Correct does, and sets x <- x (+) `correction`. If `correction` is null, sets x
  /// <- x (+) K r instead.
  Outcome CorrectBy(FilterState& f, std::span<PendingMeasurement* const> rows,
                    const double* correction);
  /// Assigns consecutive columns of the update to the measurements `rows`, which may be a subset of
  /// those that passed the gate.
  void AssignColumns(FilterState& f, std::span<PendingMeasurement* const> rows);

 private:
  /// Gain K of the rows of P that belong to consider states, and E = (K - K*) L for these rows. K*
  /// = P H' S^-1, S = L L'.
  struct ConsiderGain {
    Workspace::Matrix gain, e;
  };
  bool FindLinearisation(const FilterState& f, const PendingMeasurement& pending);
  Outcome LineariseSeparately(FilterState& f, PendingMeasurement& pending);
  void FindConsiderRows(const FilterState& f, std::span<PendingMeasurement* const> rows);
  ConsiderGain ConsiderCorrection(FilterState& f, std::span<PendingMeasurement* const> rows,
                                  bool recorded);
  bool Joseph(FilterState& f, std::span<PendingMeasurement* const> rows,
              const Workspace::Matrix* consider_gain);

  // Reused memory.
  Roles jacobian_roles_{};                      ///< values of the roles at which H is evaluated
  Scratch<std::vector<double>> implied_value_;  ///< value that z implies, for `jacobian_at`
  Scratch<std::vector<double>> jacobian_h_;     ///< h at jacobian_roles_
  Scratch<std::vector<const MeasurementRows*>> stacked_;  ///< measurements of the update
  Scratch<std::vector<int>> consider_rows_;  ///< rows of P that do not use the optimal gain
};

}  // namespace alidade::internal
