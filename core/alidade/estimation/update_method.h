// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// What Kalman filters differ in: how x and P are stepped, what a measurement is expected to be,
/// and how x and P are corrected by it. Knows nothing of gates or frames.
class UpdateMethod {
 public:
  virtual ~UpdateMethod() = default;
  /// With all that it carries besides x and P.
  virtual std::unique_ptr<UpdateMethod> Clone() const = 0;

  /// The square root of P that it carries; null: none.
  virtual const Eigen::MatrixXd* Root() const { return nullptr; }
  /// Takes over x and P as they are at the start.
  virtual void Begin(FilterState& /*f*/) {}
  /// Moves x and P by dt_s: all of it or nothing, and why.
  virtual StepError Step(FilterState& f, double dt_s) = 0;
  /// Starts an update by at most `capacity` rows.
  virtual void BeginUpdate(FilterState& /*f*/, int /*capacity*/) {}
  /// h, the innovation, R and what else the others need of a row by itself; kAccepted, or why they
  /// cannot be had, which it notes.
  virtual Outcome Predict(FilterState& f, PendingMeasurement& pending) = 0;
  /// Computes S of a row that Predict accepted, in its report. Returns its NIS, which is not a
  /// number unless S is finite and positive definite. The rows before it that are part of the
  /// update have the columns before row.linearised.column.
  virtual double ComputeNis(FilterState& f, PendingMeasurement& pending) = 0;
  /// One update with all rows, in the order of ComputeNis, R and S weighed since: all of it happens
  /// or nothing. kAccepted, and the gain is in the reports by RecordGain; or why
  /// not, which it notes but for kNotPd and kNotFinite. A row that is the reason may have an
  /// outcome of its own, in its report.
  virtual Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) = 0;
};

}  // namespace alidade::internal
