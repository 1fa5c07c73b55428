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

/// The measurements of a frame that wait for their update, with the results of their sensor models.
namespace alidade::internal {

/// Measurement of one sensor that waits for its update. m: tangent size (dof), n: size of P.
struct PendingMeasurement {
  const Measurement* measurement = nullptr;
  MeasurementReport* report = nullptr;
  int sensor = -1;
  const SensorBinding* binding = nullptr;
  /// Model of the sensor, or its model for the representation of the measured landmark.
  const SensorModel* model = nullptr;
  const SensorPlace* place = nullptr;  ///< place of the sensor, or &landmark_place; set by Bind
  SensorPlace landmark_place;          ///< place that includes the blocks of the measured landmark
  std::vector<double> numbers;         ///< z, h, innovation, S, R and L; the report points to them
  double *z = nullptr, *h = nullptr, *innovation = nullptr, *s = nullptr;  ///< s: m x m, row-major
  std::span<double> R;                                                     ///< R, m x m, row-major
  double* root = nullptr;                                                  ///< L of R = L L'
  std::vector<double> H;                       ///< m rows of place->width columns, row-major
  std::vector<double> gain;                    ///< K, column by column (MeasurementReport::gain)
  std::array<double*, kMaxRoles> jacobians{};  ///< by role: pointer to its first column in H
  Roles roles{};                               ///< result of the last call of RolesAt
  const double* roles_source = nullptr;        ///< state values to which `roles` points, or null
  double weight = 1.0;                         ///< w of the robust loss; R is divided by w
  MeasurementRows linearised;  ///< H, innovation, R, S, and the first column in the update

  /// Sets `place`, and the memory and pointers that depend on the place.
  void Bind(const SensorPlace& sensor_place);
  /// Returns whether the measured landmark is in the state.
  bool is_on_landmark() const { return place == &landmark_place; }
};

/// Pending measurements of a frame. The report points to the memory of this object, which is reused
/// for the next frame.
class PendingMeasurements {
 public:
  /// Collects the measurements of all sensors, in the order of the sensors. Appends an entry for
  /// each measurement to the report. The outcome is kAccepted, unless the measurement is not finite
  /// or invalid for its sensor. If `common_outcome` is not kAccepted, no model is called, and every
  /// measurement has this outcome.
  void Collect(const Frame& frame, const ProblemIndex& index, UpdateReport& report,
               Outcome common_outcome = Outcome::kAccepted);
  /// Collects one measurement of one sensor, with the outcome kAccepted. Does not use
  /// Measurement::stream.
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
  Outcome CheckKnownAndCovariance(const PendingMeasurement& pending);
  bool IsCovariance(const std::vector<double>& covariance, int size);

  std::vector<PendingMeasurement> rows_;  ///< only the first count_ elements are used
  std::ptrdiff_t count_ = 0;
  // Reused memory.
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  Scratch<Eigen::MatrixXd> root_;
};

/// Returns pointers to the values of the roles in x, valid until the next call. The pointers of
/// known roles point to the values in f.state.
inline const double* const* RolesAt(const FilterState& f, PendingMeasurement& pending,
                                    const std::vector<double>& x) {
  const double* const values = f.state.values().data();
  if (x.data() == values && pending.roles_source == values) return pending.roles.data();
  RolesAt(*pending.place, x.data(), values, pending.roles);
  pending.roles_source = x.data() == values ? values : nullptr;
  return pending.roles.data();
}
/// Computes h (ambient) at x and writes it to `h`.
Outcome PredictAt(const FilterState& f, PendingMeasurement& pending, const std::vector<double>& x,
                  double* h);
/// Computes h, H and R at the values of the roles. The report then points to h.
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
/// Computes R at the values of the roles. If the measurement has a covariance, copies the
/// covariance to R instead.
Outcome NoiseAt(PendingMeasurement& pending, const double* const* roles);
/// Computes the innovation z (-) h from pending.h. The report then points to the innovation.
inline void ComputeInnovation(PendingMeasurement& pending) {
  pending.report->innovation = {pending.innovation, static_cast<std::size_t>(pending.place->dof)};
  pending.model->measurement().geometry.Minus(pending.z, pending.h, pending.innovation);
}
/// Sets H <- H J in the columns of one role. J is size x size, row-major.
void ChainJacobian(PendingMeasurement& pending, int column, int size, const double* j,
                   Workspace& work);

/// Returns r' S^-1 r, or NaN if S is not positive definite. S is m x m, row-major, and factorised
/// as L D L'.
double SquaredMahalanobis(const double* s, const double* r, int m, Workspace& work);

/// Reports that h could not be computed. If h is not defined, marks the filter as diverged, unless
/// the measurement is of a landmark. An undefined h is reported only once before a measurement of
/// the sensor is accepted again.
void ReportRefusal(FilterState& f, const PendingMeasurement& pending, Outcome outcome);
/// Reports the error text of the sensor model (event `plugin_failed`).
void ReportPluginFailure(FilterState& f, const PendingMeasurement& pending);

}  // namespace alidade::internal
