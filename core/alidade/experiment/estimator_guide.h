// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// The first sensor on that stream that takes no known numbers; null: there is none.
const SensorBinding* GuidingSensor(const Problem& problem, std::string_view stream);

/// Lends the experiment's source, as long as this lives, what the filter `experiment.guide` expects
/// of it, as that filter is when it is asked, by its GuidingSensor of a stream. Does nothing where
/// none guides.
class EstimatorGuide : public Guide {
 public:
  explicit EstimatorGuide(Experiment& experiment);
  ~EstimatorGuide() override;
  EstimatorGuide(const EstimatorGuide&) = delete;
  EstimatorGuide& operator=(const EstimatorGuide&) = delete;

  std::vector<Expected> Expect(int stream, Timestamp timestamp,
                               const std::vector<std::int64_t>& landmarks) const override;

 private:
  Experiment& experiment_;
};

}  // namespace alidade::internal
