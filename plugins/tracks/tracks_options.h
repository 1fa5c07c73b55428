// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "alidade/base/timestamp.h"
#include "alidade/model/params.h"

namespace alidade {

/// What source `tracks` gives of its files: the numbers, flags and choices of its config entry.
struct TracksOptions {
  enum Measures { kPixel, kStereo, kDepth };
  enum Odometry { kNone, kZeroOrderHold, kMean };
  enum World { kFile, kFirstCamera };

  Measures measures;
  double rate_hz;
  std::int64_t start_frame;    ///< the first that is given out
  std::int64_t features_from;  ///< features that an earlier frame has are left out
  std::int64_t most;           ///< frames at most
  Odometry odometry;
  Timestamp tolerance;  ///< between a frame and its true pose
  World world;          ///< of the true poses

  explicit TracksOptions(Params& p)
      : measures(static_cast<Measures>(p.Choice("measures", {"pixel", "stereo", "depth"},
                                                "what stream tracks holds of a feature", kPixel))),
        rate_hz(p.Number("rate_hz", "Hz",
                         "frames a second, where there is no timestamps.csv; 0: there is",
                         {0.0, 1e6}, 0.0)),
        start_frame(p.Integer("start_frame", "frames before it are left out", 0, 1 << 30, 0)),
        features_from(p.Integer("features_from",
                                "features that a frame before it has are left out in all", 0,
                                1 << 30, 0)),
        most(p.Integer("max_frames", "frames at most; 0: all", 0, 1 << 30, 0)),
        odometry(static_cast<Odometry>(
            p.Choice("odometry", {"none", "zero_order_hold", "mean"},
                     "a frame's odometry.csv: none, its row, or the mean with the next frame's row",
                     kZeroOrderHold))),
        tolerance(TimestampFromSeconds(
            p.Number("truth_tolerance_s", "s",
                     "the true pose of a frame is at most so far off in time", {0.0, 1e3}, 1e-3))),
        world(static_cast<World>(p.Choice(
            "world", {"file", "first_camera"},
            "what the true poses are in: the file's world, or the first frame's camera", kFile))) {
    if (most == 0) most = INT64_MAX;
  }
};

}  // namespace alidade
