// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "alidade/estimation/filter_state.h"
#include "alidade/estimation/sensor_evaluation.h"
#include "alidade/state/kernels.h"
#include "alidade/state/workspace.h"

/// Measurements on their way into an update: what a frame has of them, and what their sensor models
/// say at some x.
namespace alidade::internal {

/// One measurement on its way into an update: m = dof, n = size of P.
struct PendingMeasurement {
  const Measurement* measurement = nullptr;
  MeasurementReport* report = nullptr;
  int sensor = -1;
  const SensorBinding* binding = nullptr;
  const SensorModel* model = nullptr;  ///< the sensor's, or that of its landmark's representation
  const SensorPlace* place = nullptr;  ///< the sensor's, or `own`; set by Bind
  SensorPlace own;                     ///< with the blocks of the landmark that it measures
  std::vector<double> numbers;  ///< z, h, the innovation, S, R and L; the report points to them
  double *z = nullptr, *h = nullptr, *innovation = nullptr, *s = nullptr;  ///< s: m x m, row-major
  std::span<double> R;                                                     ///< R, m x m, row-major
  double* root = nullptr;                                                  ///< L of R = L L'
  std::vector<double> H;                       ///< H, m rows of the place's width
  std::vector<double> gain;                    ///< as in the report
  std::array<double*, kMaxRoles> jacobians{};  ///< in H, by role
  Roles roles{};                               ///< as RolesAt last had them
  const double* roles_of = nullptr;            ///< the values of the filter, if roles are those
  double weight = 1.0;                         ///< w of the robust loss; R is divided by it
  MeasurementRows linearised;  ///< H, innovation, R and S; its column, if it passes the gate

  /// Gives it another place.
  void Bind(const SensorPlace& to);
  /// Whether it measures a landmark in the state.
  bool on_landmark() const { return place == &own; }
};

/// The rows of a frame, in memory that is kept from one to the next: there lie the numbers of their
/// reports.
class PendingMeasurements {
 public:
  /// One row for each measurement and sensor bound to its stream, in the order of the sensors, with
  /// its entry in the report: kAccepted as long as nothing speaks against it. Unless `refused` is
  /// kAccepted all have that outcome, and no model is asked.
  void Collect(const Frame& frame, const ProblemIndex& index, UpdateReport& report,
               Outcome refused = Outcome::kAccepted);
  /// The same of one measurement and one sensor, whatever their streams. kAccepted.
  PendingMeasurement& CollectOne(const Measurement& measurement, int sensor,
                                 const ProblemIndex& index, UpdateReport& report);
  std::span<PendingMeasurement> all() {
    return std::span(rows_).first(static_cast<std::size_t>(count_));
  }

 private:
  PendingMeasurement& Add(const Measurement& measurement, const SensorPlace& place);
  void Report(const PendingMeasurement& pending, Outcome outcome, UpdateReport& report);
  void PointToReports(UpdateReport& report);
  Outcome Check(const PendingMeasurement& pending);
  Outcome CheckRest(const PendingMeasurement& pending);
  bool IsCovariance(const std::vector<double>& covariance, int size);

  std::vector<PendingMeasurement> rows_;  ///< the first count_ are in use
  std::ptrdiff_t count_ = 0;
  // Memory.
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  Scratch<Eigen::MatrixXd> root_;
};

// The sensor model of a row.

/// What fills its roles at x; roles that the sensor knows have their value in f. Until the next
/// call.
inline const double* const* RolesAt(const FilterState& f, PendingMeasurement& pending,
                                    const std::vector<double>& x) {
  const double* const values = f.state.values().data();
  if (x.data() == values && pending.roles_of == values) return pending.roles.data();
  RolesAt(*pending.place, x.data(), values, pending.roles);
  pending.roles_of = x.data() == values ? values : nullptr;
  return pending.roles.data();
}
/// h at x, ambient, in `h`.
Outcome PredictAt(const FilterState& f, PendingMeasurement& pending, const std::vector<double>& x,
                  double* h);
/// h at the roles, in the report; H and R, in the row.
[[gnu::always_inline]] inline Outcome LineariseAt(PendingMeasurement& pending,
                                                  const double* const* roles) {
  const SensorPlace& place = *pending.place;
  const Measurement& measurement = *pending.measurement;
  const bool has_noise = !measurement.covariance.empty();
  pending.report->h = {pending.h, static_cast<std::size_t>(place.ambient)};
  const Status status =
      pending.model->Evaluate({measurement.values.data(), measurement.known.data()}, roles,
                              {pending.h, pending.jacobians.data(), place.strides.data(),
                               has_noise ? nullptr : pending.root});
  if (has_noise) {
    std::ranges::copy(measurement.covariance, pending.R.begin());
  } else {
    Square(pending.root, place.dof, pending.R.data());
  }
  return OutcomeOf(status);
}
/// R at the roles, or as the measurement itself says, in the row.
Outcome NoiseAt(PendingMeasurement& pending, const double* const* roles);
/// z (-) h of the h in the report, in the report.
inline void ComputeInnovation(PendingMeasurement& pending) {
  pending.report->innovation = {pending.innovation, static_cast<std::size_t>(pending.place->dof)};
  pending.model->measurement().geometry.Minus(pending.z, pending.h, pending.innovation);
}
/// H <- H J in the columns of one role, J size x size, row-major.
void ChainJacobian(PendingMeasurement& pending, int column, int size, const double* j,
                   Workspace& work);

/// r' S^-1 r by S = L D L', m x m, row-major; not a number unless S is positive definite.
double SquaredMahalanobis(const double* s, const double* r, int m, Workspace& work);

/// Tells why h of a row could not be had; outside its domain, by which the filter counts as
/// diverged, once until the sensor is accepted again.
void NoteRefusal(FilterState& f, const PendingMeasurement& pending, Outcome outcome);
void NotePluginFailure(FilterState& f, const PendingMeasurement& pending);

}  // namespace alidade::internal
