// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "alidade/model/params.h"

namespace alidade {

/// Options of the detection and tracking of features.
struct TrackerOptions {
  int features;                ///< maximum number of tracked features
  std::array<int, 2> cells;    ///< columns and rows of the grid that spreads the features
  double distance_px;          ///< minimum distance of two features
  double quality;              ///< minimum response of a corner, relative to the maximum
  int corner_px;               ///< side of the patch for the response of a corner
  int window_px;               ///< side of the tracked patch
  int levels;                  ///< number of pyramid levels above the image itself
  double forward_backward_px;  ///< maximum distance from the start after backward tracking
  double least_similarity;     ///< minimum correlation with the patch at the first detection

  /// Returns the minimum distance of a tracked point from the rim of an image, px.
  int margin() const { return window_px / 2 + 1; }

  explicit TrackerOptions(Params& p)
      : features(p.Integer("features", "maximum number of tracked features", 1, 100'000, 100)),
        cells{p.Integer("grid_columns", "columns of the grid over which features are spread", 1,
                        1000, 8),
              p.Integer("grid_rows", "rows of the grid", 1, 1000, 6)},
        distance_px(
            p.Number("distance_px", "px", "minimum distance of two features", {1.0, 1e4}, 12.0)),
        quality(p.Number("quality", "1",
                         "minimum response of a corner, relative to the maximum in its image",
                         {0.0, 1.0, true, true}, 0.01)),
        corner_px(p.Integer(
            "corner_px",
            "side of the patch for the response of a corner, px; if the patch is larger than a "
            "mark, such as a disc, the middle of the mark is found",
            3, 101, 5)),
        window_px(p.Integer("window_px", "side of the tracked patch, px", 5, 101, 21)),
        levels(p.Integer("pyramid_levels",
                         "number of pyramid levels above the image; each halves the size", 0, 10,
                         3)),
        forward_backward_px(
            p.Positive("forward_backward_px", "px",
                       "maximum distance from the previous position after tracking backward", 0.5)),
        least_similarity(
            p.Number("least_similarity", "1",
                     "minimum correlation of a feature with its patch at the first detection",
                     {-1.0, 1.0}, 0.7)) {}
};

}  // namespace alidade
