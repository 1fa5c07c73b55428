// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "alidade/estimation/update_method.h"

namespace alidade::internal {

/// The method of Ekf, which has the equations: everything by Jacobians, P dense.
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

  /// As Correct, with x (+) dx in place of x (+) K r; null: K r.
  Outcome CorrectBy(FilterState& f, std::span<PendingMeasurement* const> rows, const double* dx);
  /// Gives the rows columns that follow one another: some that passed the gate may be left out.
  void AssignColumns(FilterState& f, std::span<PendingMeasurement* const> rows);

 private:
  /// Of considered rows of P: K, and E = (K - K*) L, K* = P H' S^-1 and S = L L'.
  struct Considered {
    Workspace::Matrix gain, e;
  };
  bool FindLinearisation(const FilterState& f, const PendingMeasurement& pending);
  Outcome LineariseElsewhere(FilterState& f, PendingMeasurement& pending);
  void FindConsidered(const FilterState& f, std::span<PendingMeasurement* const> rows);
  Considered ConsiderCorrection(FilterState& f, std::span<PendingMeasurement* const> rows,
                                bool recorded);
  bool Joseph(FilterState& f, std::span<PendingMeasurement* const> rows,
              const Workspace::Matrix* considered);

  // Memory that is kept from row to row.
  Roles at_{};                            ///< where H is taken
  Scratch<std::vector<double>> implied_;  ///< of the role that is linearised at what z implies
  Scratch<std::vector<double>> h_there_;  ///< h where H is taken
  Scratch<std::vector<const MeasurementRows*>> stacked_;  ///< of the update
  Scratch<std::vector<int>> considered_;  ///< rows of P whose gain is not the optimal one
};

}  // namespace alidade::internal
