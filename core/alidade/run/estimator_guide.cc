// SPDX-License-Identifier: Apache-2.0
#include "alidade/run/estimator_guide.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "alidade/filter/filter.h"
#include "alidade/run/running_estimator.h"

namespace alidade::internal {

EstimatorGuide::EstimatorGuide(Experiment& experiment, std::function<void(bool)> busy)
    : experiment_(experiment), busy_(std::move(busy)) {
  if (experiment.guide >= 0) experiment.source->LendGuide(this);
}

EstimatorGuide::~EstimatorGuide() {
  if (experiment_.guide >= 0) experiment_.source->LendGuide(nullptr);
}

std::vector<Expected> EstimatorGuide::Expect(int stream, Timestamp timestamp,
                                             const std::vector<std::int64_t>& landmarks) const {
  std::vector<Expected> all(landmarks.size());
  const NamedEstimator& named = experiment_.estimators[static_cast<std::size_t>(experiment_.guide)];
  const auto& filter = dynamic_cast<const Filter&>(*named.estimator);
  const std::string& name = experiment_.source->streams().at(static_cast<std::size_t>(stream)).name;
  const std::vector<SensorBinding>& sensors = filter.system().sensors;
  const auto sensor = std::ranges::find(sensors, name, &SensorBinding::stream);
  if (sensor == sensors.end() || sensor->model.known_size() > 0) return all;
  const BusyWhile works(busy_);  // it calls models
  const std::vector<std::optional<Prediction>> each =
      filter.ExpectEach(sensor->name, timestamp, landmarks);
  for (std::size_t i = 0; i < each.size(); ++i) {
    if (each[i]) all[i] = {each[i]->z, {each[i]->s.data(), each[i]->s.data() + each[i]->s.size()}};
  }
  return all;
}

}  // namespace alidade::internal
