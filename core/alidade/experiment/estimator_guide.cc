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
  if (experiment.guide != nullptr) experiment.source->LendGuide(this);
}

// A source that throws here keeps a guide that is gone; the run has ended, and asks it no more.
EstimatorGuide::~EstimatorGuide() {
  try {
    if (experiment_.guide != nullptr) experiment_.source->LendGuide(nullptr);
  } catch (...) {
    return;
  }
}

std::vector<Expected> EstimatorGuide::Expect(int stream, Timestamp timestamp,
                                             const std::vector<std::int64_t>& landmarks) const {
  std::vector<Expected> all(landmarks.size());
  const Filter& filter = *experiment_.guide;
  const std::string& name = experiment_.source->streams().at(static_cast<std::size_t>(stream)).name;
  const SensorBinding* const sensor = GuidingSensor(filter.problem(), name);
  if (sensor == nullptr) return all;
  const std::vector<std::optional<Prediction>> each =
      filter.ExpectEach(sensor->name, timestamp, landmarks);
  for (std::size_t i = 0; i < each.size(); ++i) {
    if (each[i]) all[i] = {each[i]->z, {each[i]->s.data(), each[i]->s.data() + each[i]->s.size()}};
  }
  return all;
}

}  // namespace alidade::internal
