// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Returns the first sensor on `stream` without known numbers, or null.
const SensorBinding* GuidingSensor(const Problem& problem, std::string_view stream);

/// Guide of the source of an experiment: predicts its measurements with the current state of the
/// filter `experiment.guide` and its GuidingSensor. Sets itself as the guide of the source in the
/// constructor and removes itself in the destructor. Has no effect without a guiding filter.
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
