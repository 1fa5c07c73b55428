// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {

/// What became of Simulate().
struct SimulateResult {
  std::int64_t frames = 0;
  bool stopped = false;            ///< before the end
  std::vector<std::string> files;  ///< names in the folder
};

/// Images of what the camera sees, next to the data: their names in the folder, "" for none.
struct SimulateImages {
  std::string video;   ///< a file, NAME.avi
  std::string folder;  ///< of PNG, one for each frame
};

/// Writes what the source of `config` gives into `folder`, without any estimator: the files that
/// source `tracks` reads, and truth.
///
///   file              rows
///   timestamps.csv    frame,t_s
///   STREAM.csv        of a stream of landmarks frame,feature,dim,value; of any other frame,t_s and
///                     its values
///   truth.csv         t_s and the values of all truths
///   truth.tum         t x y z qx qy qz qw of the first truth X.position with an X.orientation
///   map.csv           feature,x,y,z, m: of each landmark that was seen, where the source knows
///   calibration.yaml  the config's `camera`, for a config to include
///   simulate.json     {"status": "ok", or "stopped" before the end, "frames": N}
///   images.video      an image of each frame, MJPG: what the source draws; else equal discs at the
///                     first two values (u, v), px, of all measurements of landmarks, as large as
///                     the config's `camera`. Of a pair NAME_left.avi and NAME_right.avi
///   images.folder     the same as NUMBER.png; of a pair in its folders left and right
///
/// Only files that have something to hold are there. The folder appears when all is written; one
/// that is there is replaced where `force`. `stop` true: ends after the frame. Errors: kBadConfig,
/// kPlugin, kBadData, kCannotCreate, kNotTrusted (an image outside the folder), kIo, ...
SimulateResult Simulate(const Config& config, const PluginHost& host,
                        const std::filesystem::path& folder, bool force,
                        const std::function<bool()>& stop = {}, const SimulateImages& images = {});

}  // namespace alidade
