// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "alidade/model/params.h"

namespace alidade {

/// How features are found and followed.
struct TrackerOptions {
  int features;                ///< as many are followed, where the image has them
  std::array<int, 2> cells;    ///< columns and rows of the grid that spreads them
  double distance_px;          ///< between two, at least
  double quality;              ///< least response of a corner, of the strongest in the image
  int corner_px;               ///< side of the patch over which a corner is told
  int window_px;               ///< side of the patch that is followed
  int levels;                  ///< of the pyramid, above the image itself
  double forward_backward_px;  ///< between a feature and where it is followed back to, at most
  double least_similarity;  ///< of the patch now and where the feature was found: their correlation

  /// How far from the rim of an image a point is that can be followed, px.
  int margin() const { return window_px / 2 + 1; }

  explicit TrackerOptions(Params& p)
      : features(p.Integer("features", "features that are followed, where the image has them", 1,
                           100'000, 100)),
        cells{p.Integer("grid_columns", "of the grid over which features are spread", 1, 1000, 8),
              p.Integer("grid_rows", "of that grid", 1, 1000, 6)},
        distance_px(
            p.Number("distance_px", "px", "between two features, at least", {1.0, 1e4}, 12.0)),
        quality(p.Number("quality", "1",
                         "least response of a corner, as a share of the strongest of its image",
                         {0.0, 1.0, true, true}, 0.01)),
        corner_px(p.Integer("corner_px",
                            "side of the patch over which a corner is told: small marks, such as "
                            "discs, are found at their middle where it is larger than they are",
                            3, 101, 5)),
        window_px(p.Integer("window_px", "side of the patch that is followed", 5, 101, 21)),
        levels(p.Integer("pyramid_levels", "halved images above the image itself", 0, 10, 3)),
        forward_backward_px(p.Positive(
            "forward_backward_px", "px",
            "a feature is lost where it is followed back to farther from where it was", 0.5)),
        least_similarity(p.Number(
            "least_similarity", "1",
            "a feature is lost where its patch correlates less with that where it was found",
            {-1.0, 1.0}, 0.7)) {}
};

}  // namespace alidade
