// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Equations of one type of Kalman filter, which propagate x and P, predict a measurement, and
/// correct x and P by measurements. The equations are independent of gates and frames.
class UpdateMethod {
 public:
  virtual ~UpdateMethod() = default;
  /// Returns a copy that shares no data with this object.
  virtual std::unique_ptr<UpdateMethod> Clone() const = 0;

  /// Returns the square root D of P = D D' if the method stores one, else an empty matrix.
  virtual Eigen::MatrixXd Root(const FilterState& /*f*/) const { return {}; }
  /// Called before the first frame with the initial x and P, and after a recovery changed x or P.
  virtual void Begin(FilterState& /*f*/) {}
  /// Propagates x and P by dt_s. If this fails, returns the error and leaves x and P unchanged.
  virtual StepError Step(FilterState& f, double dt_s) = 0;
  /// Starts an update with measurements that have at most `capacity` rows in total.
  virtual void BeginUpdate(FilterState& /*f*/, int /*capacity*/) {}
  /// Computes h, the innovation and R of one measurement at the current state. Returns kAccepted or
  /// the reason for a failure. A failure is also reported as an event.
  virtual Outcome Predict(FilterState& f, PendingMeasurement& pending) = 0;
  /// Computes S of a measurement that Predict accepted, and writes S to the report. Returns the
  /// NIS, or NaN if S is not finite or not positive definite. The measurement uses the columns of
  /// the update from linearised.column on. The columns before belong to measurements that were
  /// accepted earlier.
  virtual double ComputeNis(FilterState& f, PendingMeasurement& pending) = 0;
  /// Corrects x and P by one stacked update, in the order of the calls of ComputeNis. R and S
  /// include the robust weights. If the update succeeds, writes the gains to the reports
  /// (RecordGain) and returns kAccepted. Otherwise leaves x and P unchanged and returns the reason.
  /// Also reports the reason as an event, unless the reason is kNotPd or kNotFinite. The report of
  /// the measurement that caused the failure may contain another outcome.
  virtual Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) = 0;
};

}  // namespace alidade::internal
