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

/// Returns the mark that represents the outcome of a measurement in an image.
Mark MarkOf(Outcome outcome);

/// Stores the positions of image features in recent frames, and which features have had an accepted
/// measurement.
class FeatureTrails {
 public:
  /// Adds a frame. Returns the features of the frame and the lost features. A lost feature was in
  /// the previous frame, but is not in this frame. A feature is a landmark measurement whose first
  /// two values are a pixel. `report` is null if no estimator processed the frame.
  std::vector<ViewFeature> Add(const Frame& frame, const UpdateReport* report);

 private:
  using Trail = std::vector<std::array<double, 2>>;

  ViewFeature FeatureOf(const Measurement& m, const UpdateReport* report);

  std::map<std::int64_t, Trail> trails_;  ///< trails of the features in the previous frame
  std::set<std::int64_t> accepted_;
};

}  // namespace alidade::internal
