// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rows.h"

#include <algorithm>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/projection.h"
#include "alidade/state/tiles.h"
#include "alidade/state/vector_kernels.h"

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
  const Geometry& geometry = bound.model->measurement().geometry;
  ALIDADE_EXPECTS(std::ssize(measurement.values) == geometry.ambient);
  ALIDADE_EXPECTS(std::ssize(measurement.known) == bound.model->known_size());
  ALIDADE_EXPECTS(measurement.covariance.empty() ||
                  std::ssize(measurement.covariance) == geometry.tangent * geometry.tangent);
  if (count_ == rows_.size()) rows_.emplace_back();
  Row& row = rows_[count_++];
  row.measurement = &measurement;
  row.sensor = sensor;
  row.binding = &bound;
  row.model = bound.model.get();
  row.place = &binding.sensor_places[index];
  MeasurementReport& entry = report.Add();
  entry.Reset(sensor, measurement.landmark, geometry.tangent);
  entry.z.assign(measurement.values.begin(), measurement.values.end());
  row.report = &entry;
  return row;
}

/// What speaks against the measurement of a row, by itself.
Outcome Rows::Check(const Row& row) {
  constexpr double kRounding = 1e-12, kSymmetric = 1e-9;
  const Measurement& m = *row.measurement;
  if (!AllFinite(m.values) || !AllFinite(m.covariance) || !AllFinite(m.known)) {
    return Outcome::kNotFinite;
  }
  if (!m.covariance.empty()) {
    const int size = row.model->measurement().geometry.tangent;
    const Eigen::Map<const Eigen::MatrixXd> r(m.covariance.data(), size, size);
    if (!r.isApprox(r.transpose(), kSymmetric) || SquareRootOf(r, ldlt_, root_) < -kRounding) {
      return Outcome::kInvalid;
    }
  }
  return OutcomeOf(row.model->Valid({m.values.data(), m.known.data()}));
}

void RolesAt(const SensorBinding& sensor, const SensorPlace& place, const std::vector<double>& x,
             const std::vector<double>& known_roles, std::vector<const double*>& roles) {
  roles.clear();
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    const int at = place.values[i];
    const bool knows = i < sensor.roles.size() && sensor.roles[i].mode == RoleMode::kKnown;
    roles.push_back(at < 0 ? nullptr : (knows ? known_roles : x).data() + at);
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   std::vector<double*>& columns, std::vector<double>& h,
                   std::vector<double>* jacobian) {
  const double* const known = measurement.known.data();
  const Geometry& geometry = model.measurement().geometry;
  h.assign(static_cast<std::size_t>(geometry.ambient), kNotWritten);
  if (jacobian == nullptr) return OutcomeOf(model.Predict(roles, h.data(), known));
  const int m = geometry.tangent;
  jacobian->assign(static_cast<std::size_t>(m) * static_cast<std::size_t>(place.width), 0.0);
  for (const JacobianPart& part : place.parts) {
    for (int i = 0; i < m; ++i) {
      std::fill_n(jacobian->data() + i * place.width + part.column, part.size, kNotWritten);
    }
  }
  columns.clear();
  for (const int column : place.columns) {
    columns.push_back(column < 0 ? nullptr : jacobian->data() + column);
  }
  return OutcomeOf(model.Linearise(roles, h.data(), columns.data(), place.strides.data(), known));
}

Outcome NoiseAt(const SensorModel& model, const Measurement& measurement,
                const double* const* roles, std::vector<double>& l, std::vector<double>& r) {
  if (!measurement.covariance.empty()) {
    r.assign(measurement.covariance.begin(), measurement.covariance.end());
    return Outcome::kAccepted;
  }
  const auto m = static_cast<std::size_t>(model.measurement().geometry.tangent);
  r.resize(m * m);
  l.assign(m * m, kNotWritten);
  const Outcome outcome = OutcomeOf(
      model.SqrtNoise(roles, measurement.values.data(), l.data(), measurement.known.data()));
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
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
  return EvaluateAt(*row.model, *row.place, *row.measurement, roles, row.memory.columns,
                    row.report->h, &row.H);
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.measurement, roles, row.memory.l, row.R);
}

void TakeInnovation(Row& row) {
  MeasurementReport& entry = *row.report;
  entry.innovation.resize(static_cast<std::size_t>(entry.dof));
  row.model->measurement().geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
}

void ChainJacobian(Row& row, int column, int size, const double* j, Workspace& work) {
  const Workspace::Use use(work);
  const int m = row.report->dof;
  auto own = Eigen::Map<RowMajor>(row.H.data(), m, row.place->width).middleCols(column, size);
  Workspace::Matrix chained = work.Take(m, size);
  chained.noalias() = own * Eigen::Map<const RowMajor>(j, size, size);
  own = chained;
}

Eigen::Index TotalDof(std::span<Row* const> rows) {
  Eigen::Index m = 0;
  for (const Row* row : rows) m += row->report->dof;
  return m;
}

void RecordGain(const FilterState& f, std::span<Row* const> rows, const double* gain) {
  const int n = f.size();
  for (const Row* row : rows) {
    const double* const end = gain + n * row->report->dof;
    for (; gain != end; gain += n) {
      if (!GainIsRecorded(*row)) continue;
      for (const int i : f.blocks.gain_rows) row->report->gain.push_back(gain[i]);
    }
  }
}

Stacked Stack(FilterState& f, std::span<Row* const> rows) {
  return {JacobianOf(f, rows), NoiseOf(f, rows), InnovationOf(f, rows)};
}

Workspace::Matrix JacobianOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Matrix h = f.work.Take(TotalDof(rows), f.size());
  h.setZero();
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    const JacobianRows own = row.jacobian();
    const Eigen::Map<const RowMajor> compact(own.data, own.rows, own.stride);
    for (const JacobianPart& part : own.parts) {
      h.block(at, part.offset, own.rows, part.size) += compact.middleCols(part.column, part.size);
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

Panels ProjectionOf(FilterState& f, std::span<Row* const> rows) {
  const Panels pht = TakePanels(f.work, f.size(), TotalDof(rows));
  f.jacobians.clear();
  for (const Row* const row : rows) f.jacobians.push_back(row->jacobian());
  Project(f.state.covariance(), f.jacobians, pht);
  return pht;
}

void AddProjected(const FilterState& f, const Panels& pht, Workspace::Matrix& s) {
  BestVectorKernels().add_projected(pht.rows, f.jacobians, pht.data, s.data(), s.outerStride());
}

}  // namespace alidade::internal
