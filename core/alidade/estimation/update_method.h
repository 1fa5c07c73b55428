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
  /// A copy with everything that the method stores besides x and P.
  virtual std::unique_ptr<UpdateMethod> Clone() const = 0;

  /// The square root of P if the method stores one, else null.
  virtual const Eigen::MatrixXd* Root() const { return nullptr; }
  /// Called once, before the first frame, with the initial x and P.
  virtual void Begin(FilterState& /*f*/) {}
  /// Propagates x and P by dt_s. If it fails, both are unchanged and the error is returned.
  virtual StepError Step(FilterState& f, double dt_s) = 0;
  /// Starts an update by at most `capacity` rows.
  virtual void BeginUpdate(FilterState& /*f*/, int /*capacity*/) {}
  /// Computes h, the innovation and R of one measurement at the state. Returns kAccepted, or the
  /// reason for a failure, which it also reports as an event.
  virtual Outcome Predict(FilterState& f, PendingMeasurement& pending) = 0;
  /// Computes S of a measurement that Predict accepted, and writes it into its report. Returns the
  /// NIS, which is NaN unless S is finite and positive definite. The measurement has the columns of
  /// the update from linearised.column on, those that passed before it the columns before.
  virtual double ComputeNis(FilterState& f, PendingMeasurement& pending) = 0;
  /// Corrects x and P by one stacked update, in the order of ComputeNis; R and S have their robust
  /// weights by now. Returns kAccepted, with the gains in the reports (RecordGain). Otherwise x and
  /// P are unchanged, and it returns the reason and reports it as an event, except kNotPd and
  /// kNotFinite. A measurement that is the reason may have an outcome of its own in its report.
  virtual Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) = 0;
};

}  // namespace alidade::internal
