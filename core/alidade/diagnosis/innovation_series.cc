// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/innovation_series.h"

#include <cmath>

namespace alidade {

InnovationSeries::InnovationSeries(const SensorBinding& binding)
    : sensor(binding.name),
      dof(binding.model->measurement().geometry.tangent),
      ambient(binding.model->measurement().geometry.ambient),
      z_index(static_cast<std::size_t>(dof), -1),
      is_angle(static_cast<std::size_t>(dof), 0),
      has_robust_loss(binding.loss.kind != LossKind::kNone),
      has_landmark_prior(binding.model->inverse().prior_size > 0) {
  const Space& measured = binding.model->measurement();
  std::size_t part_index = 0;
  measured.geometry.ForEachPart([&](const Geometry& part, int ambient_offset, int tangent_offset) {
    const bool has_parts = !measured.part_units.empty();
    const std::string& unit = has_parts ? measured.part_units[part_index++] : measured.unit;
    units.insert(units.end(), static_cast<std::size_t>(part.ambient), unit);
    if (part.ambient != part.tangent) return;
    for (int i = 0; i < part.tangent; ++i) {
      const int element = tangent_offset + i;
      z_index[static_cast<std::size_t>(element)] = ambient_offset + i;
      is_angle[static_cast<std::size_t>(element)] = part.is_angle() ? 1 : 0;
    }
  });
}

void InnovationSeries::Add(Timestamp timestamp, const MeasurementReport& measurement) {
  const auto m = static_cast<std::size_t>(dof), a = static_cast<std::size_t>(ambient);
  ++total;
  out_of_domain += measurement.outcome == Outcome::kOutOfDomain;
  frames += timestamp != last;
  if (first == kNoTimestamp) first = timestamp;
  last = timestamp;
  if (!Stores(measurement.outcome) || size() == kMaxSize || measurement.innovation.size() != m ||
      measurement.s.size() != m * m || measurement.z.size() != a || measurement.h.size() != a ||
      !std::isfinite(measurement.nis)) {
    return;
  }
  timestamps.push_back(timestamp);
  landmarks.push_back(measurement.landmark);
  accepted.push_back(measurement.outcome == Outcome::kAccepted ? 1 : 0);
  nis.push_back(measurement.nis);
  innovation.insert(innovation.end(), measurement.innovation.begin(), measurement.innovation.end());
  for (std::size_t i = 0; i < m; ++i) sigma.push_back(std::sqrt(measurement.s[i * (m + 1)]));
  z.insert(z.end(), measurement.z.begin(), measurement.z.end());
  h.insert(h.end(), measurement.h.begin(), measurement.h.end());
}

std::int64_t InnovationSeries::accepted_frames() const {
  std::int64_t count = 0;
  Timestamp previous = kNoTimestamp;
  for (std::size_t i = 0; i < size(); ++i) {
    if (accepted[i] == 0) continue;
    count += timestamps[i] != previous;
    previous = timestamps[i];
  }
  return count;
}

}  // namespace alidade
