// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "alidade/estimation/method.h"
#include "alidade/state/panels.h"

namespace alidade::internal {

/// The method of Ekf, which has the equations: everything by Jacobians, P dense.
class Linear : public Method {
 public:
  std::unique_ptr<Method> Clone() const override { return std::make_unique<Linear>(*this); }
  Trouble Step(FilterState& f, double dt_s) override;
  Outcome Predict(FilterState& f, Row& row) override;
  Outcome Correct(FilterState& f, std::span<Row* const> rows) override {
    return CorrectBy(f, rows, nullptr);
  }

  /// The first part of Predict: h, H, R and the innovation at x.
  Outcome Linearise(FilterState& f, Row& row);
  /// The second: S = H P H' + R of a row that has H and R.
  static void TakeS(const FilterState& f, Row& row);
  /// As Correct, with x (+) dx in place of x (+) K r; null: K r.
  Outcome CorrectBy(FilterState& f, std::span<Row* const> rows, const double* dx);

 private:
  bool FindLinearisation(const FilterState& f, const Row& row);
  Outcome LineariseElsewhere(FilterState& f, Row& row);
  Outcome CorrectSmall(FilterState& f, std::span<Row* const> rows, const double* dx);
  Outcome CorrectLarge(FilterState& f, std::span<Row* const> rows, const double* dx);
  /// Of the rows in lost_: K, and E = (K - K*) L.
  struct Lost {
    Workspace::Matrix gain, e;
  };
  Lost FindLost(FilterState& f, std::span<Row* const> rows, const Panels& w,
                const Workspace::Matrix& l);

  // Memory that is kept from row to row.
  Scratch<std::vector<const double*>> at_;  ///< what fills the roles where H is taken
  Scratch<std::vector<double>> implied_;    ///< of the role that is linearised at what z implies
  Scratch<std::vector<double>> h_there_;    ///< h where H is taken
  Scratch<std::vector<int>> lost_;          ///< rows of P whose gain is not the optimal one
};

}  // namespace alidade::internal
