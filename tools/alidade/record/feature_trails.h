// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/record/run_view.h"

namespace alidade::internal {

/// What the outcome of a measurement is shown as.
Mark MarkOf(Outcome outcome);

/// Features over the frames: where each was, and whether it was ever accepted.
class FeatureTrails {
 public:
  /// The features of a frame, the measurements of landmarks whose first two values are a pixel,
  /// with those of the frame before that are lost. `report` is null where no estimator took it.
  std::vector<ViewFeature> Take(const Frame& frame, const UpdateReport* report);

 private:
  using Trail = std::vector<std::array<double, 2>>;

  ViewFeature FeatureOf(const Measurement& m, const UpdateReport* report);

  std::map<std::int64_t, Trail> trails_;  ///< of the frame before
  std::set<std::int64_t> accepted_;
};

}  // namespace alidade::internal
