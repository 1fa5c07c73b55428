// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/pending_measurements.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {

[[gnu::noinline]] void PendingMeasurement::Bind(const SensorPlace& sensor_place) {
  place = &sensor_place;
  sensor = sensor_place.sensor;
  binding = sensor_place.binding;
  model = binding->model.get();
  roles_source = nullptr;
  const auto a = static_cast<std::size_t>(sensor_place.ambient),
             m = static_cast<std::size_t>(sensor_place.dof),
             width = static_cast<std::size_t>(sensor_place.width);
  numbers.resize(2 * a + m + 3 * m * m);
  z = numbers.data();
  h = z + a;
  innovation = h + a;
  s = innovation + m;
  R = {s + m * m, m * m};
  root = s + 2 * m * m;
  // NaN reveals elements that the model does not write.
  std::fill(h, numbers.data() + numbers.size(), kNotANumber);
  H.assign(m * width, kNotANumber);
  for (std::size_t i = 0; i < sensor_place.columns.size(); ++i) {
    jacobians[i] = sensor_place.columns[i] < 0 ? nullptr : H.data() + sensor_place.columns[i];
  }
  linearised = {{H.data(), sensor_place.dof, sensor_place.rows}, innovation, R.data(), s};
}

/// Appends a measurement of the sensor.
[[gnu::always_inline]] inline PendingMeasurement& PendingMeasurements::Add(
    const Measurement& measurement, const SensorPlace& place) {
  const std::ptrdiff_t ambient = place.ambient;
  ALIDADE_EXPECTS(std::ssize(measurement.values) == ambient);
  if (rows_.begin() + count_ == rows_.end()) rows_.emplace_back();
  PendingMeasurement& pending = rows_[static_cast<std::size_t>(count_++)];
  if (pending.place != &place) pending.Bind(place);
  pending.measurement = &measurement;
  const double* const values = measurement.values.data();
  double* const z = pending.z;
  for (std::ptrdiff_t i = 0; i < ambient; ++i) z[i] = values[i];
  return pending;
}

/// Appends an entry for the measurement to the report.
[[gnu::always_inline]] inline void PendingMeasurements::Report(const PendingMeasurement& pending,
                                                               Outcome outcome,
                                                               UpdateReport& report) {
  MeasurementReport& entry =
      report.Add(pending.sensor, outcome, pending.measurement->landmark, pending.place->dof);
  entry.z = {pending.z, static_cast<std::size_t>(pending.place->ambient)};
}

/// Sets PendingMeasurement::report. Must be called after the last entry was appended, because
/// appending may move the entries in memory.
void PendingMeasurements::PointToReports(UpdateReport& report) {
  MeasurementReport* entry = report.measurements().data();
  for (PendingMeasurement& pending : all()) pending.report = entry++;
}

/// Returns kAccepted if the measurement can be used. Otherwise returns the outcome that states the
/// reason.
[[gnu::always_inline]] inline Outcome PendingMeasurements::Check(
    const PendingMeasurement& pending) {
  const Measurement& m = *pending.measurement;
  if (!AllFinite(m.values)) return Outcome::kNotFinite;
  if (!m.known.empty() || !m.covariance.empty() || pending.place->known_size > 0) {
    const Outcome outcome = CheckKnownAndCovariance(pending);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  return OutcomeOf(pending.model->Valid({m.values.data(), m.known.data()}));
}

/// Checks the known numbers and the covariance of a measurement. Returns kAccepted if both are
/// valid.
[[gnu::noinline]] Outcome PendingMeasurements::CheckKnownAndCovariance(
    const PendingMeasurement& pending) {
  const Measurement& m = *pending.measurement;
  const int dof = pending.place->dof;
  ALIDADE_EXPECTS(std::ssize(m.known) == pending.place->known_size);
  ALIDADE_EXPECTS(m.covariance.empty() || std::ssize(m.covariance) == dof * dof);
  if (!AllFinite(m.known) || !AllFinite(m.covariance)) return Outcome::kNotFinite;
  const bool is_invalid = !m.covariance.empty() && !IsCovariance(m.covariance, dof);
  return is_invalid ? Outcome::kInvalid : Outcome::kAccepted;
}

bool PendingMeasurements::IsCovariance(const std::vector<double>& covariance, int size) {
  constexpr double kRounding = 1e-12, kSymmetric = 1e-9;
  const Eigen::Map<const Eigen::MatrixXd> r(covariance.data(), size, size);
  return r.isApprox(r.transpose(), kSymmetric) && SquareRootOf(r, ldlt_, root_) >= -kRounding;
}

[[gnu::noinline]] void PendingMeasurements::Collect(const Frame& frame, const ProblemIndex& index,
                                                    UpdateReport& report, Outcome common_outcome) {
  count_ = 0;
  report.ClearMeasurements();
  for (const SensorPlace& place : index.sensor_places) {
    const int stream = index.stream_of_sensor[static_cast<std::size_t>(place.sensor)];
    for (const Measurement& m : frame.measurements) {
      if (m.stream != stream) continue;
      const PendingMeasurement& pending = Add(m, place);
      Report(pending, common_outcome != Outcome::kAccepted ? common_outcome : Check(pending),
             report);
    }
  }
  PointToReports(report);
}

PendingMeasurement& PendingMeasurements::CollectOne(const Measurement& measurement, int sensor,
                                                    const ProblemIndex& index,
                                                    UpdateReport& report) {
  count_ = 0;
  report.ClearMeasurements();
  PendingMeasurement& pending =
      Add(measurement, index.sensor_places[static_cast<std::size_t>(sensor)]);
  Report(pending, Outcome::kAccepted, report);
  PointToReports(report);
  return pending;
}

Outcome PredictAt(const FilterState& f, PendingMeasurement& pending, const std::vector<double>& x,
                  double* h) {
  return EvaluateAt(*pending.model, *pending.place, *pending.measurement, RolesAt(f, pending, x),
                    {.h = h});
}

Outcome NoiseAt(PendingMeasurement& pending, const double* const* roles) {
  return NoiseAt(*pending.model, *pending.place, *pending.measurement, roles, pending.root,
                 pending.R.data());
}

double SquaredMahalanobis(const double* s, const double* r, int m, Workspace& work) {
  const Workspace::Use use(work);
  const Eigen::Map<const RowMajor> matrix(s, m, m);
  Workspace::Matrix l = work.Take(m, m);  // L D, with D on the diagonal
  Workspace::Vector y = work.Take(m);     // L^-1 r
  double sum = 0.0;
  for (int i = 0; i < m; ++i) {
    l(i, i) = matrix(i, i);
    y[i] = r[i];
    for (int j = 0; j < i; ++j) {
      l(i, j) = matrix(i, j);
      for (int k = 0; k < j; ++k) l(i, j) -= l(i, k) * l(j, k) / l(k, k);
      l(i, i) -= l(i, j) * l(i, j) / l(j, j);
      y[i] -= l(i, j) / l(j, j) * y[j];
    }
    if (!(l(i, i) > 0.0)) return std::nan("");
    sum += y[i] * y[i] / l(i, i);
  }
  return sum;
}

void ChainJacobian(PendingMeasurement& pending, int column, int size, const double* j,
                   Workspace& work) {
  const Workspace::Use use(work);
  const int m = pending.report->dof;
  auto jacobian =
      Eigen::Map<RowMajor>(pending.H.data(), m, pending.place->width).middleCols(column, size);
  Workspace::Matrix chained = work.Take(m, size);
  chained.noalias() = jacobian * Eigen::Map<const RowMajor>(j, size, size);
  jacobian = chained;
}

[[gnu::noinline]] void ReportPluginFailure(FilterState& f, const PendingMeasurement& pending) {
  AddEvent(f, EventKind::kPluginFailed,
           "sensor '" + pending.binding->name + "': " + pending.model->error_text());
}

[[gnu::noinline]] void ReportRefusal(FilterState& f, const PendingMeasurement& pending,
                                     Outcome outcome) {
  const SensorBinding& sensor = *pending.binding;
  if (outcome == Outcome::kFailed) ReportPluginFailure(f, pending);
  char& is_reported = f.health.out_of_domain[static_cast<std::size_t>(pending.sensor)];
  // A landmark outside the domain of the sensor, such as a landmark behind the camera, does not
  // mean that the filter diverged.
  if (outcome != Outcome::kOutOfDomain || pending.is_on_landmark() || is_reported != 0) return;
  is_reported = 1;
  std::vector<BlockId> blocks;
  for (const RoleBinding& role : sensor.roles) blocks.push_back(role.block);
  AddDivergenceEvent(
      f, EventKind::kDiverged,
      "the model of sensor '" + sensor.name + "' is not defined at " + Describe(f.state, blocks));
}

}  // namespace alidade::internal
