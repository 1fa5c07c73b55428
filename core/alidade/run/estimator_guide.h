// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "alidade/host/source.h"
#include "alidade/run/experiment.h"

namespace alidade::internal {

/// Lends the experiment's source, as long as this lives, what the filter `experiment.guide` expects
/// of it, as that filter is when it is asked. The first of its sensors on a stream is asked. Does
/// nothing where none guides.
class EstimatorGuide : public Guide {
 public:
  /// `busy` as RunOptions has it.
  EstimatorGuide(Experiment& experiment, std::function<void(bool)> busy);
  ~EstimatorGuide() override;
  EstimatorGuide(const EstimatorGuide&) = delete;
  EstimatorGuide& operator=(const EstimatorGuide&) = delete;

  std::vector<Expected> Expect(int stream, Timestamp timestamp,
                               const std::vector<std::int64_t>& landmarks) const override;

 private:
  Experiment& experiment_;
  std::function<void(bool)> busy_;
};

}  // namespace alidade::internal
