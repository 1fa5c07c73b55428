// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/estimator_guide.h"

#include <algorithm>
#include <optional>

#include "alidade/estimation/filter.h"

namespace alidade::internal {

const SensorBinding* GuidingSensor(const Problem& problem, std::string_view stream) {
  const auto found = std::ranges::find_if(problem.sensors, [&](const SensorBinding& sensor) {
    return sensor.stream == stream && sensor.model->known_size() == 0;
  });
  return found == problem.sensors.end() ? nullptr : &*found;
}

EstimatorGuide::EstimatorGuide(Experiment& experiment) : experiment_(experiment) {
  if (experiment.guide != nullptr) experiment.source->SetGuide(this);
}

// If SetGuide throws, the source retains a dangling pointer to the guide. The source does not use
// the guide after the run.
EstimatorGuide::~EstimatorGuide() {
  try {
    if (experiment_.guide != nullptr) experiment_.source->SetGuide(nullptr);
  } catch (...) {
    return;
  }
}

std::vector<ExpectedMeasurement> EstimatorGuide::Expect(
    int stream, Timestamp timestamp, const std::vector<std::int64_t>& landmarks) const {
  std::vector<ExpectedMeasurement> expected(landmarks.size());
  const Filter& filter = *experiment_.guide;
  const std::string& name = experiment_.source->streams().at(static_cast<std::size_t>(stream)).name;
  const SensorBinding* const sensor = GuidingSensor(filter.problem(), name);
  if (sensor == nullptr) return expected;
  const std::vector<std::optional<Prediction>> predictions =
      filter.ExpectEach(sensor->name, timestamp, landmarks);
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    if (!predictions[i]) continue;
    const Prediction& prediction = *predictions[i];
    expected[i] = {prediction.z, {prediction.s.data(), prediction.s.data() + prediction.s.size()}};
  }
  return expected;
}

}  // namespace alidade::internal
