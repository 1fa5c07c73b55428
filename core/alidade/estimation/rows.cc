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

/// R = L L', m x m, row-major.
void Square(const double* l, int m, double* r) {
  if (m == 1) {
    r[0] = l[0] * l[0];
    return;
  }
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
}

}  // namespace

void Row::Bind(const SensorPlace& to) {
  place = &to;
  roles_of = nullptr;
  H.resize(static_cast<std::size_t>(to.dof) * static_cast<std::size_t>(to.width));
  for (std::size_t i = 0; i < to.columns.size(); ++i) {
    jacobians[i] = to.columns[i] < 0 ? nullptr : H.data() + to.columns[i];
  }
}

void Rows::Collect(const Frame& frame, const Binding& binding, UpdateReport& report,
                   std::optional<Outcome> refused) {
  count_ = 0;
  report.ClearMeasurements();
  report.Reserve(frame.measurements.size() * binding.sensor_places.size());  // rows point to them
  for (std::size_t sensor = 0, sensors = binding.sensor_places.size(); sensor < sensors; ++sensor) {
    for (const Measurement& m : frame.measurements) {
      if (m.stream != binding.stream_of_sensor[sensor]) continue;
      const Row& row = Add(m, static_cast<int>(sensor), binding, report);
      row.report->outcome = refused ? *refused : Check(row);
    }
  }
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
  const auto ambient = static_cast<std::size_t>(place.ambient),
             m = static_cast<std::size_t>(place.dof);
  ALIDADE_EXPECTS(measurement.values.size() == ambient);
  ALIDADE_EXPECTS(std::ssize(measurement.known) == bound.model->known_size());
  ALIDADE_EXPECTS(measurement.covariance.empty() || measurement.covariance.size() == m * m);
  if (count_ == rows_.size()) rows_.emplace_back();
  Row& row = rows_[count_++];
  row.measurement = &measurement;
  row.sensor = sensor;
  row.binding = &bound;
  row.model = bound.model.get();
  if (row.place != &place) row.Bind(place);
  row.z = report.Allocate(2 * ambient + m + 3 * m * m);
  row.h = row.z + ambient;
  row.innovation = row.h + ambient;
  row.s = row.innovation + m;
  row.R = {row.s + m * m, m * m};
  row.root = row.s + 2 * m * m;
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
  if (!AllFinite(m.values) || !AllFinite(m.known) || !AllFinite(m.covariance)) {
    return Outcome::kNotFinite;
  }
  if (!m.covariance.empty() && !IsCovariance(m.covariance, row.place->dof)) {
    return Outcome::kInvalid;
  }
  return OutcomeOf(row.model->Valid({m.values.data(), m.known.data()}));
}

bool Rows::IsCovariance(const std::vector<double>& covariance, int size) {
  constexpr double kRounding = 1e-12, kSymmetric = 1e-9;
  const Eigen::Map<const Eigen::MatrixXd> r(covariance.data(), size, size);
  return r.isApprox(r.transpose(), kSymmetric) && SquareRootOf(r, ldlt_, root_) >= -kRounding;
}

void RolesAt(const SensorPlace& place, const double* x, const double* known_roles, Roles& roles) {
  for (std::size_t i = 0, count = place.values.size(); i < count; ++i) {
    const int at = place.values[i];
    roles[i] = at < 0 ? nullptr : (place.known[i] != 0 ? known_roles : x) + at;
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   const EvaluationOutput& to) {
  std::array<double*, kMaxRoles> jacobians;
  SensorModel::Output output{to.h, nullptr, nullptr, to.l};
  if (to.jacobian != nullptr) {
    for (std::size_t i = 0, count = place.columns.size(); i < count; ++i) {
      jacobians[i] = place.columns[i] < 0 ? nullptr : to.jacobian + place.columns[i];
    }
    output.jacobians = jacobians.data();
    output.strides = place.strides.data();
  }
  return OutcomeOf(
      model.Evaluate({measurement.values.data(), measurement.known.data()}, roles, output));
}

Outcome NoiseAt(const SensorModel& model, const SensorPlace& place, const Measurement& measurement,
                const double* const* roles, double* l, double* r) {
  if (!measurement.covariance.empty()) {
    std::ranges::copy(measurement.covariance, r);
    return Outcome::kAccepted;
  }
  const Outcome outcome = EvaluateAt(model, place, measurement, roles, {.l = l});
  Square(l, place.dof, r);
  return outcome;
}

const double* const* RolesAt(const FilterState& f, Row& row, const std::vector<double>& x) {
  const double* const values = f.state.values().data();
  if (x.data() == values && row.roles_of == values) return row.roles.data();
  RolesAt(*row.place, x.data(), values, row.roles);
  row.roles_of = x.data() == values ? values : nullptr;
  return row.roles.data();
}

Outcome PredictAt(const FilterState& f, Row& row, const std::vector<double>& x, double* h) {
  return EvaluateAt(*row.model, *row.place, *row.measurement, RolesAt(f, row, x), {.h = h});
}

Outcome LineariseAt(Row& row, const double* const* roles) {
  const SensorPlace& place = *row.place;
  const Measurement& measurement = *row.measurement;
  const bool has_noise = !measurement.covariance.empty();
  row.report->h = {row.h, static_cast<std::size_t>(place.ambient)};
  const Outcome outcome = OutcomeOf(row.model->Evaluate(
      {measurement.values.data(), measurement.known.data()}, roles,
      {row.h, row.jacobians.data(), place.strides.data(), has_noise ? nullptr : row.root}));
  if (has_noise) {
    std::ranges::copy(measurement.covariance, row.R.begin());
  } else {
    Square(row.root, place.dof, row.R.data());
  }
  return outcome;
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.place, *row.measurement, roles, row.root, row.R.data());
}

void ComputeInnovation(Row& row) {
  row.report->innovation = {row.innovation, static_cast<std::size_t>(row.place->dof)};
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

void RecordGain(FilterState& f, std::span<Row* const> rows, const ConstMatrix& gain) {
  RecordGainBy(f, rows, [&](std::span<const int> kept, int column, int count, double* to) {
    for (int j = column; j < column + count; ++j) {
      for (const int i : kept) *to++ = gain(i, j);
    }
  });
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
