// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/rows.h"

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/filter/filter_state.h"
#include "alidade/filter/square_root.h"

namespace alidade::internal {

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
  const Geometry& geometry = bound.model.measurement().geometry;
  ALIDADE_EXPECTS(std::ssize(measurement.values) == geometry.ambient);
  ALIDADE_EXPECTS(std::ssize(measurement.known) == bound.model.known_size());
  ALIDADE_EXPECTS(measurement.covariance.empty() ||
                  std::ssize(measurement.covariance) == geometry.tangent * geometry.tangent);
  if (count_ == rows_.size()) rows_.emplace_back();
  Row& row = rows_[count_++];
  row.measurement = &measurement;
  row.sensor = sensor;
  row.binding = &bound;
  row.model = &bound.model;
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
  return OutcomeOf(row.model->Valid(m.values.data(), m.known.data()));
}

Eigen::Index CountOf(std::span<Row* const> rows) {
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

}  // namespace alidade::internal
