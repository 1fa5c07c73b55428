// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rows.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Calls take(row, at) for each row, `at` of the update's m where it begins.
template <class Take>
void ForEachPlace(std::span<Row* const> rows, const Take& take) {
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    take(*row, at);
    at += row->report->dof;
  }
}

/// Makes room for `count` numbers.
void Fit(std::vector<double>& numbers, int count) {
  if (std::ssize(numbers) != count) numbers.resize(static_cast<std::size_t>(count));
}

/// R = L L', m x m, row-major.
void Square(const double* l, int m, double* r) {
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
}

}  // namespace

void Rows::Collect(const Frame& frame, const Binding& binding, UpdateReport& report,
                   std::optional<Outcome> refused) {
  count_ = 0;
  report.ClearMeasurements();
  for (std::size_t sensor = 0; sensor < binding.sensor_places.size(); ++sensor) {
    for (const Measurement& m : frame.measurements) {
      if (m.stream != binding.stream_of_sensor[sensor]) continue;
      const Row& row = Add(m, static_cast<int>(sensor), binding, report);
      row.report->outcome = refused ? *refused : Check(row);
    }
  }
  // An entry moves where one is added.
  for (std::size_t i = 0; i < count_; ++i) rows_[i].report = &report.measurements()[i];
}

Row& Rows::CollectOne(const Measurement& measurement, int sensor, const Binding& binding,
                      UpdateReport& report) {
  count_ = 0;
  report.ClearMeasurements();
  return Add(measurement, sensor, binding, report);
}

Row& Rows::Add(const Measurement& measurement, int sensor, const Binding& binding,
               UpdateReport& report) {
  const auto index = static_cast<std::size_t>(sensor);
  const SensorBinding& bound = binding.system.sensors[index];
  const SensorPlace& place = binding.sensor_places[index];
  ALIDADE_EXPECTS(std::ssize(measurement.values) == place.ambient);
  ALIDADE_EXPECTS(std::ssize(measurement.known) == bound.model->known_size());
  ALIDADE_EXPECTS(measurement.covariance.empty() ||
                  std::ssize(measurement.covariance) == place.dof * place.dof);
  if (count_ == rows_.size()) rows_.emplace_back();
  Row& row = rows_[count_++];
  row.measurement = &measurement;
  row.sensor = sensor;
  row.binding = &bound;
  row.model = bound.model.get();
  row.place = &place;
  const auto ambient = static_cast<std::size_t>(place.ambient),
             m = static_cast<std::size_t>(place.dof);
  row.z = report.Allocate(2 * ambient + m + m * m);
  row.h = row.z + ambient;
  row.innovation = row.h + ambient;
  row.s = row.innovation + m;
  for (std::size_t i = 0; i < ambient; ++i) row.z[i] = measurement.values[i];
  MeasurementReport& entry = report.Add();
  entry.sensor = sensor;
  entry.landmark = measurement.landmark;
  entry.dof = place.dof;
  entry.z = {row.z, ambient};
  row.report = &entry;
  return row;
}

/// The outcome of a measurement by itself: kAccepted, or why it is of no use.
Outcome Rows::Check(const Row& row) {
  const Measurement& m = *row.measurement;
  if (!AllFinite(m.values) || !AllFinite(m.known)) return Outcome::kNotFinite;
  if (!m.covariance.empty()) {
    const Outcome outcome = CheckCovariance(row);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  return OutcomeOf(row.model->Valid({m.values.data(), m.known.data()}));
}

Outcome Rows::CheckCovariance(const Row& row) {
  constexpr double kRounding = 1e-12, kSymmetric = 1e-9;
  const std::vector<double>& covariance = row.measurement->covariance;
  if (!AllFinite(covariance)) return Outcome::kNotFinite;
  const int size = row.report->dof;
  const Eigen::Map<const Eigen::MatrixXd> r(covariance.data(), size, size);
  const bool valid =
      r.isApprox(r.transpose(), kSymmetric) && SquareRootOf(r, ldlt_, root_) >= -kRounding;
  return valid ? Outcome::kAccepted : Outcome::kInvalid;
}

void RolesAt(const SensorBinding& sensor, const SensorPlace& place, const std::vector<double>& x,
             const std::vector<double>& known_roles, std::vector<const double*>& roles) {
  if (roles.size() != place.values.size()) roles.resize(place.values.size());
  for (std::size_t i = 0; i < roles.size(); ++i) {
    const int at = place.values[i];
    const bool knows = i < sensor.roles.size() && sensor.roles[i].mode == RoleMode::kKnown;
    roles[i] = at < 0 ? nullptr : (knows ? known_roles : x).data() + at;
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles, double* h,
                   double* jacobian) {
  const double* const known = measurement.known.data();
  for (int i = 0; i < place.ambient; ++i) h[i] = kNotWritten;
  if (jacobian == nullptr) return OutcomeOf(model.Predict(roles, h, known));
  for (int i = 0; i < place.dof * place.width; ++i) jacobian[i] = kNotWritten;
  std::array<double*, kMaxRoles> columns;
  for (std::size_t i = 0; i < place.columns.size(); ++i) {
    columns[i] = place.columns[i] < 0 ? nullptr : jacobian + place.columns[i];
  }
  return OutcomeOf(model.Linearise(roles, h, columns.data(), place.strides.data(), known));
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   std::vector<double>& h, std::vector<double>* jacobian) {
  Fit(h, place.ambient);
  if (jacobian != nullptr) Fit(*jacobian, place.dof * place.width);
  return EvaluateAt(model, place, measurement, roles, h.data(),
                    jacobian == nullptr ? nullptr : jacobian->data());
}

Outcome NoiseAt(const SensorModel& model, const Measurement& measurement,
                const double* const* roles, std::vector<double>& l, std::vector<double>& r) {
  if (!measurement.covariance.empty()) {
    r.assign(measurement.covariance.begin(), measurement.covariance.end());
    return Outcome::kAccepted;
  }
  const int m = model.measurement().geometry.tangent;
  Fit(r, m * m);
  Fit(l, m * m);
  for (double& number : l) number = kNotWritten;
  const Outcome outcome = OutcomeOf(
      model.SqrtNoise(roles, measurement.values.data(), l.data(), measurement.known.data()));
  Square(l.data(), m, r.data());
  return outcome;
}

const double* const* RolesAt(const FilterState& f, Row& row, const std::vector<double>& x) {
  RolesAt(*row.binding, *row.place, x, f.state.values(), row.roles);
  return row.roles.data();
}

Outcome PredictAt(const FilterState& f, Row& row, const std::vector<double>& x, double* h) {
  std::fill_n(h, row.model->measurement().geometry.ambient, kNotWritten);
  return OutcomeOf(row.model->Predict(RolesAt(f, row, x), h, row.measurement->known.data()));
}

Outcome LineariseAt(Row& row, const double* const* roles) {
  const SensorPlace& place = *row.place;
  Fit(row.H, place.dof * place.width);
  row.report->h = {row.h, static_cast<std::size_t>(place.ambient)};
  return EvaluateAt(*row.model, *row.place, *row.measurement, roles, row.h, row.H.data());
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.measurement, roles, row.l, row.R);
}

void ComputeInnovation(Row& row) {
  row.report->innovation = {row.innovation, static_cast<std::size_t>(row.report->dof)};
  row.model->measurement().geometry.Minus(row.z, row.h, row.innovation);
}

double ComputeNis(const Row& row, Workspace& work) {
  return SquaredMahalanobis(row.s, row.innovation, row.report->dof, work);
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

int TotalDof(std::span<Row* const> rows) {
  int m = 0;
  for (const Row* row : rows) m += row->report->dof;
  return m;
}

Stacked Stack(FilterState& f, std::span<Row* const> rows) {
  return {JacobianOf(f, rows), NoiseOf(f, rows), InnovationOf(f, rows)};
}

Workspace::Matrix JacobianOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Matrix h = f.work.Take(TotalDof(rows), f.size());
  h.setZero();
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    const JacobianRows own = row.jacobian();
    const Eigen::Map<const RowMajor> compact(own.data, own.rows, own.width());
    for (int c = 0; c < own.width(); ++c) {
      h.col(own.columns[static_cast<std::size_t>(c)]).segment(at, own.rows) += compact.col(c);
    }
  });
  return h;
}

Workspace::Matrix NoiseOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Matrix noise = f.work.Take(TotalDof(rows), TotalDof(rows));
  noise.setZero();
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    const Eigen::Index k = row.report->dof;
    noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(row.R.data(), k, k);
  });
  return noise;
}

Workspace::Vector InnovationOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Vector innovation = f.work.Take(TotalDof(rows));
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    std::ranges::copy(row.report->innovation, innovation.data() + at);
  });
  return innovation;
}

}  // namespace alidade::internal
