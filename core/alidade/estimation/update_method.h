// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Propagation and correction equations of one type of Kalman filter: steps x and P, predicts a
/// measurement, corrects x and P by measurements. Independent of gates and frames.
class UpdateMethod {
 public:
  virtual ~UpdateMethod() = default;
  /// Returns a copy of the method, with its own data.
  virtual std::unique_ptr<UpdateMethod> Clone() const = 0;

  /// Returns the square root of P if the method stores one, else null.
  virtual const Eigen::MatrixXd* Root() const { return nullptr; }
  /// Called once, before the first frame, with the initial x and P.
  virtual void Begin(FilterState& /*f*/) {}
  /// Propagates x and P by dt_s. If it fails, both are unchanged and the error is returned.
  virtual StepError Step(FilterState& f, double dt_s) = 0;
  /// Starts an update by measurements of at most `capacity` rows in total.
  virtual void BeginUpdate(FilterState& /*f*/, int /*capacity*/) {}
  /// Computes h, the innovation and R of one measurement at the state. Returns kAccepted, or the
  /// reason for a failure, which it also reports as an event.
  virtual Outcome Predict(FilterState& f, PendingMeasurement& pending) = 0;
  /// Computes S of a measurement that Predict accepted, and writes it to its report. Returns the
  /// NIS, or NaN unless S is finite and positive definite. The measurement uses the columns of the
  /// update from linearised.column on, after those of the measurements accepted before it.
  virtual double ComputeNis(FilterState& f, PendingMeasurement& pending) = 0;
  /// Corrects x and P by one stacked update, in the order of ComputeNis. R and S include the robust
  /// weights. Returns kAccepted and writes the gains to the reports (RecordGain). Otherwise x and P
  /// are unchanged, and the reason is returned. The reason is also reported as an event, except
  /// kNotPd and kNotFinite. The report of the measurement that caused it may have another outcome.
  virtual Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) = 0;
};

}  // namespace alidade::internal
