// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rows.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {

[[gnu::noinline]] void Row::Bind(const SensorPlace& to) {
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
[[gnu::always_inline]] inline Row& Rows::Add(const Measurement& measurement,
                                             const SensorPlace& place) {
  const std::ptrdiff_t ambient = place.ambient;
  ALIDADE_EXPECTS(std::ssize(measurement.values) == ambient);
  if (rows_.begin() + count_ == rows_.end()) rows_.emplace_back();
  Row& row = rows_[static_cast<std::size_t>(count_++)];
  if (row.place != &place) row.Bind(place);
  row.measurement = &measurement;
  const double* const values = measurement.values.data();
  double* const z = row.z;
  for (std::ptrdiff_t i = 0; i < ambient; ++i) z[i] = values[i];
  return row;
}

/// Its entry in the report.
[[gnu::always_inline]] inline void Rows::Report(const Row& row, Outcome outcome,
                                                UpdateReport& report) {
  MeasurementReport& entry =
      report.Add(row.sensor, outcome, row.measurement->landmark, row.place->dof);
  entry.z = {row.z, static_cast<std::size_t>(row.place->ambient)};
}

/// Once there are no more.
void Rows::PointToReports(UpdateReport& report) {
  MeasurementReport* entry = report.measurements().data();
  for (Row& row : all()) row.report = entry++;
}

/// The outcome of a measurement by itself: kAccepted, or why it is of no use.
[[gnu::always_inline]] inline Outcome Rows::Check(const Row& row) {
  const Measurement& m = *row.measurement;
  if (!AllFinite(m.values)) return Outcome::kNotFinite;
  if (!m.known.empty() || !m.covariance.empty() || row.place->known_size > 0) {
    const Outcome outcome = CheckRest(row);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  return OutcomeOf(row.model->Valid({m.values.data(), m.known.data()}));
}

/// The same of its known numbers and its covariance.
[[gnu::noinline]] Outcome Rows::CheckRest(const Row& row) {
  const Measurement& m = *row.measurement;
  const int dof = row.place->dof;
  ALIDADE_EXPECTS(std::ssize(m.known) == row.place->known_size);
  ALIDADE_EXPECTS(m.covariance.empty() || std::ssize(m.covariance) == dof * dof);
  if (!AllFinite(m.known) || !AllFinite(m.covariance)) return Outcome::kNotFinite;
  const bool refused = !m.covariance.empty() && !IsCovariance(m.covariance, dof);
  return refused ? Outcome::kInvalid : Outcome::kAccepted;
}

bool Rows::IsCovariance(const std::vector<double>& covariance, int size) {
  constexpr double kRounding = 1e-12, kSymmetric = 1e-9;
  const Eigen::Map<const Eigen::MatrixXd> r(covariance.data(), size, size);
  return r.isApprox(r.transpose(), kSymmetric) && SquareRootOf(r, ldlt_, root_) >= -kRounding;
}

[[gnu::noinline]] void Rows::Collect(const Frame& frame, const Binding& binding,
                                     UpdateReport& report, Outcome refused) {
  count_ = 0;
  report.ClearMeasurements();
  for (const SensorPlace& place : binding.sensor_places) {
    const int stream = binding.stream_of_sensor[static_cast<std::size_t>(place.sensor)];
    for (const Measurement& m : frame.measurements) {
      if (m.stream != stream) continue;
      const Row& row = Add(m, place);
      Report(row, refused != Outcome::kAccepted ? refused : Check(row), report);
    }
  }
  PointToReports(report);
}

Row& Rows::CollectOne(const Measurement& measurement, int sensor, const Binding& binding,
                      UpdateReport& report) {
  count_ = 0;
  report.ClearMeasurements();
  Row& row = Add(measurement, binding.sensor_places[static_cast<std::size_t>(sensor)]);
  Report(row, Outcome::kAccepted, report);
  PointToReports(report);
  return row;
}

Outcome PredictAt(const FilterState& f, Row& row, const std::vector<double>& x, double* h) {
  return EvaluateAt(*row.model, *row.place, *row.measurement, RolesAt(f, row, x), {.h = h});
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.place, *row.measurement, roles, row.root, row.R.data());
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

void ChainJacobian(Row& row, int column, int size, const double* j, Workspace& work) {
  const Workspace::Use use(work);
  const int m = row.report->dof;
  auto own = Eigen::Map<RowMajor>(row.H.data(), m, row.place->width).middleCols(column, size);
  Workspace::Matrix chained = work.Take(m, size);
  chained.noalias() = own * Eigen::Map<const RowMajor>(j, size, size);
  own = chained;
}

[[gnu::noinline]] void NotePluginFailure(FilterState& f, const Row& row) {
  Note(f, "plugin_failed", "sensor '" + row.binding->name + "': " + row.model->error_text());
}

[[gnu::noinline]] void NoteRefusal(FilterState& f, const Row& row, Outcome outcome) {
  const SensorBinding& sensor = *row.binding;
  if (outcome == Outcome::kFailed) NotePluginFailure(f, row);
  char& said = f.health.out_of_domain[static_cast<std::size_t>(row.sensor)];
  // A landmark behind the camera, say, is no divergence.
  if (outcome != Outcome::kOutOfDomain || row.on_landmark() || said != 0) return;
  said = 1;
  std::vector<BlockId> blocks;
  for (const RoleBinding& role : sensor.roles) blocks.push_back(role.block);
  NoteDivergence(f, "diverged",
                 "sensor '" + sensor.name + "' is not defined at " + Describe(f.state, blocks));
}

}  // namespace alidade::internal
