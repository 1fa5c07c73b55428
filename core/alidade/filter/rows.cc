// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/filter/filter_state.h"
#include "alidade/filter/square_root.h"
#include "alidade/state/small_kernels.h"

namespace alidade::internal {

void Rows::Collect(const Frame& frame, const Binding& binding, UpdateReport& report,
                   std::optional<Outcome> refused) {
  count_ = 0;
  report.ClearMeasurements();
  for (std::size_t sensor = 0; sensor < binding.sensor_places.size(); ++sensor) {
    for (const Measurement& m : frame.measurements) {
      if (m.stream != binding.stream_of_sensor[sensor]) continue;
      const Row& row = Add(m, static_cast<int>(sensor), binding, report);
      report.measurements().back().outcome = refused ? *refused : OutcomeOf(row);
    }
  }
  Link(report);
}

Row& Rows::CollectOne(const Measurement& measurement, int sensor, const Binding& binding,
                      UpdateReport& report) {
  count_ = 0;
  report.ClearMeasurements();
  Row& row = Add(measurement, sensor, binding, report);
  Link(report);
  return row;
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
  return row;
}

/// What speaks against the measurement of a row, by itself.
Outcome Rows::OutcomeOf(const Row& row) {
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
  return alidade::OutcomeOf(row.model->Valid(m.values.data(), m.known.data()));
}

/// References into the report end with each entry that is added.
void Rows::Link(UpdateReport& report) {
  for (std::size_t i = 0; i < count_; ++i) rows_[i].report = &report.measurements()[i];
}

Gate::Gate(const System& system, double probability) : warned_(system.sensors.size(), false) {
  for (const SensorBinding& sensor : system.sensors) {
    thresholds_.push_back(
        probability < 1.0
            ? ChiSquareQuantile(probability, sensor.model.measurement().geometry.tangent)
            : std::numeric_limits<double>::infinity());
  }
}

Outcome Gate::Pass(FilterState& f, Row& row) {
  MeasurementReport& entry = *row.report;
  if (!AllFinite(entry.s) || !AllFinite(row.PHt) || !AllFinite(entry.innovation)) {
    entry.s.clear();
    Note(f, "not_finite",
         "sensor '" + row.binding->name + "': h, H, R or the innovation is not finite");
    return Outcome::kNotFinite;
  }
  CheckConditioning(f, row);
  const auto m = static_cast<std::size_t>(entry.dof);
  memory_.resize(m * (m + 1));
  entry.nis =
      SquaredMahalanobis(entry.s.data(), entry.innovation.data(), entry.dof, memory_.data());
  if (std::isnan(entry.nis)) {
    entry.nis = 0.0;
    Note(f, "not_pd", "sensor '" + row.binding->name + "': S is not positive definite");
    return Outcome::kNotPd;
  }
  if (!(entry.nis <= thresholds_[static_cast<std::size_t>(row.sensor)])) return Outcome::kGated;
  row.weight = Weight(row.binding->loss, std::sqrt(entry.nis));
  const double widest = *std::ranges::max_element(row.R) / row.weight;
  return std::isfinite(widest) ? Outcome::kAccepted : Outcome::kGated;
}

void Gate::Weigh(Row& row) {
  if (row.weight == 1.0) return;
  for (std::size_t i = 0; i < row.R.size(); ++i) {
    const double widened = row.R[i] / row.weight;
    row.report->s[i] += widened - row.R[i];
    row.R[i] = widened;
  }
}

/// Warns once for each sensor whose noise vanishes compared with H P H'.
void Gate::CheckConditioning(FilterState& f, const Row& row) {
  const auto sensor = static_cast<std::size_t>(row.sensor);
  if (warned_[sensor]) return;
  const auto m = static_cast<std::size_t>(row.report->dof);
  double noise = 0.0, total = 0.0;
  bool tiny = false;
  for (std::size_t i = 0; i < m && !tiny; ++i) {
    noise = row.R[i * m + i];
    total = row.report->s[i * m + i];
    tiny = noise <= kVanishing * total || noise <= 0.0;
  }
  if (!tiny) return;
  warned_[sensor] = true;
  Note(f, "conditioning",
       "sensor '" + row.binding->name + "': noise variance " + RoundedText(noise, 3) +
           " vanishes compared with H P H' = " + RoundedText(total - noise, 3) +
           "; S is badly conditioned");
}

}  // namespace alidade::internal
