// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "alidade/base/timestamp.h"
#include "alidade/model/params.h"

namespace alidade {

/// Numbers and choices in the config entry of source `tracks`.
struct TracksOptions {
  enum Measures { kPixel, kStereo, kDepth };
  enum Odometry { kNone, kZeroOrderHold, kMean };
  enum World { kFile, kFirstCamera };

  Measures measures;
  double rate_hz;
  std::int64_t start_frame;    ///< first frame of the source
  std::int64_t features_from;  ///< omits features that occur in an earlier frame
  std::int64_t max_frames;     ///< maximum number of frames
  Odometry odometry;
  Timestamp tolerance;  ///< maximum time from a frame to its true pose
  World world;          ///< coordinate frame of the true poses

  explicit TracksOptions(Params& p)
      : measures(static_cast<Measures>(p.Choice("measures", {"pixel", "stereo", "depth"},
                                                "values of a feature in stream tracks", kPixel))),
        rate_hz(p.Number("rate_hz", "Hz",
                         "frames per second, if there is no timestamps.csv; 0: timestamps.csv",
                         {0.0, 1e6}, 0.0)),
        start_frame(p.Integer("start_frame", "frames before this one are skipped", 0, 1 << 30, 0)),
        features_from(p.Integer("features_from",
                                "features of earlier frames are omitted from all frames", 0,
                                1 << 30, 0)),
        max_frames(p.Integer("max_frames", "maximum number of frames; 0: all", 0, 1 << 30, 0)),
        odometry(static_cast<Odometry>(p.Choice(
            "odometry", {"none", "zero_order_hold", "mean"},
            "odometry of a frame: none, its row, or the mean of its row and the next frame's row",
            kZeroOrderHold))),
        tolerance(TimestampFromSeconds(
            p.Number("truth_tolerance_s", "s",
                     "maximum time difference of the true pose of a frame", {0.0, 1e3}, 1e-3))),
        world(static_cast<World>(p.Choice(
            "world", {"file", "first_camera"},
            "coordinate frame of the true poses: the file's world, or the first frame's camera",
            kFile))) {
    if (max_frames == 0) max_frames = INT64_MAX;
  }
};

}  // namespace alidade
