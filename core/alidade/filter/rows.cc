// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/rows.h"

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"

namespace alidade::internal {

void Rows::Collect(const Frame& frame, const Binding& binding, UpdateReport& report) {
  count_ = 0;
  report.ClearMeasurements();
  for (std::size_t sensor = 0; sensor < binding.sensor_places.size(); ++sensor) {
    const SensorBinding& bound = binding.system.sensors[sensor];
    const Geometry& geometry = bound.model.measurement().geometry;
    for (const Measurement& m : frame.measurements) {
      if (m.stream != binding.stream_of_sensor[sensor]) continue;
      ALIDADE_EXPECTS(std::ssize(m.values) == geometry.ambient);
      ALIDADE_EXPECTS(m.covariance.empty() ||
                      std::ssize(m.covariance) == geometry.tangent * geometry.tangent);
      if (count_ == rows_.size()) rows_.emplace_back();
      Row& row = rows_[count_++];
      row.measurement = &m;
      row.sensor = static_cast<int>(sensor);
      row.binding = &bound;
      row.model = &bound.model;
      row.place = &binding.sensor_places[sensor];
      MeasurementReport& entry = report.Add();
      entry.Reset(row.sensor, m.landmark, geometry.tangent);
      entry.z.assign(m.values.begin(), m.values.end());
      entry.outcome =
          AllFinite(entry.z) ? OutcomeOf(bound.model.Valid(entry.z.data())) : Outcome::kNotFinite;
    }
  }
  for (std::size_t i = 0; i < count_; ++i) rows_[i].report = &report.measurements()[i];
}

}  // namespace alidade::internal
