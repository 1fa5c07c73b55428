// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/pending_measurements.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {

[[gnu::noinline]] void PendingMeasurement::Bind(const SensorPlace& to) {
  place = &to;
  sensor = to.sensor;
  binding = to.binding;
  model = binding->model.get();
  roles_of = nullptr;
  const auto a = static_cast<std::size_t>(to.ambient), m = static_cast<std::size_t>(to.dof),
             width = static_cast<std::size_t>(to.width);
  numbers.resize(2 * a + m + 3 * m * m);
  z = numbers.data();
  h = z + a;
  innovation = h + a;
  s = innovation + m;
  R = {s + m * m, m * m};
  root = s + 2 * m * m;
  std::fill(h, numbers.data() + numbers.size(), kNotANumber);  // whatever a model leaves out
  H.assign(m * width, kNotANumber);
  for (std::size_t i = 0; i < to.columns.size(); ++i) {
    jacobians[i] = to.columns[i] < 0 ? nullptr : H.data() + to.columns[i];
  }
  linearised = {{H.data(), to.dof, to.rows}, innovation, R.data(), s};
}

/// The row of a measurement.
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

/// Its entry in the report.
[[gnu::always_inline]] inline void PendingMeasurements::Report(const PendingMeasurement& pending,
                                                               Outcome outcome,
                                                               UpdateReport& report) {
  MeasurementReport& entry =
      report.Add(pending.sensor, outcome, pending.measurement->landmark, pending.place->dof);
  entry.z = {pending.z, static_cast<std::size_t>(pending.place->ambient)};
}

/// Once there are no more.
void PendingMeasurements::PointToReports(UpdateReport& report) {
  MeasurementReport* entry = report.measurements().data();
  for (PendingMeasurement& pending : all()) pending.report = entry++;
}

/// The outcome of a measurement by itself: kAccepted, or why it is of no use.
[[gnu::always_inline]] inline Outcome PendingMeasurements::Check(
    const PendingMeasurement& pending) {
  const Measurement& m = *pending.measurement;
  if (!AllFinite(m.values)) return Outcome::kNotFinite;
  if (!m.known.empty() || !m.covariance.empty() || pending.place->known_size > 0) {
    const Outcome outcome = CheckRest(pending);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  return OutcomeOf(pending.model->Valid({m.values.data(), m.known.data()}));
}

/// The same of its known numbers and its covariance.
[[gnu::noinline]] Outcome PendingMeasurements::CheckRest(const PendingMeasurement& pending) {
  const Measurement& m = *pending.measurement;
  const int dof = pending.place->dof;
  ALIDADE_EXPECTS(std::ssize(m.known) == pending.place->known_size);
  ALIDADE_EXPECTS(m.covariance.empty() || std::ssize(m.covariance) == dof * dof);
  if (!AllFinite(m.known) || !AllFinite(m.covariance)) return Outcome::kNotFinite;
  const bool refused = !m.covariance.empty() && !IsCovariance(m.covariance, dof);
  return refused ? Outcome::kInvalid : Outcome::kAccepted;
}

bool PendingMeasurements::IsCovariance(const std::vector<double>& covariance, int size) {
  constexpr double kRounding = 1e-12, kSymmetric = 1e-9;
  const Eigen::Map<const Eigen::MatrixXd> r(covariance.data(), size, size);
  return r.isApprox(r.transpose(), kSymmetric) && SquareRootOf(r, ldlt_, root_) >= -kRounding;
}

[[gnu::noinline]] void PendingMeasurements::Collect(const Frame& frame, const ProblemIndex& index,
                                                    UpdateReport& report, Outcome refused) {
  count_ = 0;
  report.ClearMeasurements();
  for (const SensorPlace& place : index.sensor_places) {
    const int stream = index.stream_of_sensor[static_cast<std::size_t>(place.sensor)];
    for (const Measurement& m : frame.measurements) {
      if (m.stream != stream) continue;
      const PendingMeasurement& pending = Add(m, place);
      Report(pending, refused != Outcome::kAccepted ? refused : Check(pending), report);
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
  const Eigen::Map<const RowMajor> given(s, m, m);
  Workspace::Matrix l = work.Take(m, m);  // L D, D on the diagonal
  Workspace::Vector y = work.Take(m);     // L^-1 r
  double sum = 0.0;
  for (int i = 0; i < m; ++i) {
    l(i, i) = given(i, i);
    y[i] = r[i];
    for (int j = 0; j < i; ++j) {
      l(i, j) = given(i, j);
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
  auto own =
      Eigen::Map<RowMajor>(pending.H.data(), m, pending.place->width).middleCols(column, size);
  Workspace::Matrix chained = work.Take(m, size);
  chained.noalias() = own * Eigen::Map<const RowMajor>(j, size, size);
  own = chained;
}

[[gnu::noinline]] void NotePluginFailure(FilterState& f, const PendingMeasurement& pending) {
  Note(f, "plugin_failed",
       "sensor '" + pending.binding->name + "': " + pending.model->error_text());
}

[[gnu::noinline]] void NoteRefusal(FilterState& f, const PendingMeasurement& pending,
                                   Outcome outcome) {
  const SensorBinding& sensor = *pending.binding;
  if (outcome == Outcome::kFailed) NotePluginFailure(f, pending);
  char& said = f.health.out_of_domain[static_cast<std::size_t>(pending.sensor)];
  // A landmark behind the camera, say, is no divergence.
  if (outcome != Outcome::kOutOfDomain || pending.on_landmark() || said != 0) return;
  said = 1;
  std::vector<BlockId> blocks;
  for (const RoleBinding& role : sensor.roles) blocks.push_back(role.block);
  NoteDivergence(f, "diverged",
                 "sensor '" + sensor.name + "' is not defined at " + Describe(f.state, blocks));
}

}  // namespace alidade::internal
