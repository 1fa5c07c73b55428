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
  std::int64_t features_from;  ///< features that occur in an earlier frame are omitted
  std::int64_t max_frames;     ///< maximum number of frames
  Odometry odometry;
  Timestamp tolerance;  ///< maximum time from a frame to its true pose
  World world;          ///< coordinate frame of the true poses

  explicit TracksOptions(Params& p)
      : measures(static_cast<Measures>(p.Choice("measures", {"pixel", "stereo", "depth"},
                                                "values of a feature in stream tracks", kPixel))),
        rate_hz(p.Number("rate_hz", "Hz", "frames per second; 0: timestamps.csv contains the times",
                         {0.0, 1e6}, 0.0)),
        start_frame(
            p.Integer("start_frame", "first frame; earlier frames are skipped", 0, 1 << 30, 0)),
        features_from(p.Integer(
            "features_from", "features that occur before this frame are omitted", 0, 1 << 30, 0)),
        max_frames(p.Integer("max_frames", "maximum number of frames; 0: all", 0, 1 << 30, 0)),
        odometry(static_cast<Odometry>(
            p.Choice("odometry", {"none", "zero_order_hold", "mean"},
                     "odometry of a frame: none; its row; or the mean of its row and the next row",
                     kZeroOrderHold))),
        tolerance(TimestampFromSeconds(p.Number("truth_tolerance_s", "s",
                                                "maximum time from a frame to its true pose",
                                                {0.0, 1e3}, 1e-3))),
        world(static_cast<World>(p.Choice(
            "world", {"file", "first_camera"},
            "coordinate frame of the true poses: the world of the file, or the first camera",
            kFile))) {
    if (max_frames == 0) max_frames = INT64_MAX;
  }
};

}  // namespace alidade
