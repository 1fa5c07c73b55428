// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Returns the first sensor on `stream` without known numbers, or null.
const SensorBinding* GuidingSensor(const Problem& problem, std::string_view stream);

/// Guide of the source of an experiment. This object predicts measurements from the current state
/// of the filter `experiment.guide`. The predicted sensor is the GuidingSensor() of this filter.
/// The constructor sets this object as the guide of the source, and the destructor removes it. This
/// object has no effect if `experiment.guide` is null.
class EstimatorGuide : public Guide {
 public:
  explicit EstimatorGuide(Experiment& experiment);
  ~EstimatorGuide() override;
  EstimatorGuide(const EstimatorGuide&) = delete;
  EstimatorGuide& operator=(const EstimatorGuide&) = delete;

  std::vector<ExpectedMeasurement> Expect(
      int stream, Timestamp timestamp, const std::vector<std::int64_t>& landmarks) const override;

 private:
  Experiment& experiment_;
};

}  // namespace alidade::internal
