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

/// Result of Simulate().
struct SimulateResult {
  std::int64_t frames = 0;
  bool stopped = false;            ///< stopped before the end
  std::vector<std::string> files;  ///< names in the folder
};

/// Names of camera images in the folder of the data; "": none.
struct SimulateImages {
  std::string video;   ///< a file, NAME.avi
  std::string folder;  ///< a folder of PNG files, one for each frame
};

/// Writes the data of the source of `config` to `folder`, without an estimator: the files that
/// source `tracks` reads, and the truth.
///
///   file              rows
///   timestamps.csv    frame,t_s
///   STREAM.csv        stream of landmarks: frame,feature,dim,value; other stream: frame,t_s and
///                     its values
///   truth.csv         t_s and the values of all truths
///   truth.tum         t x y z qx qy qz qw of the first truth X.position with an X.orientation
///   map.csv           feature,x,y,z, m: true positions of measured landmarks, if known
///   calibration.yaml  the config's `camera`, for a config to include
///   simulate.json     {"status": "ok", or "stopped" before the end, "frames": N}
///   images.video      MJPG video with an image of each frame: drawn by the source, or else equal
///                     discs at the first two values (u, v), px, of landmark measurements, in the
///                     size of the config's `camera`. Stereo pair: NAME_left.avi, NAME_right.avi
///   images.folder     the same images as NUMBER.png; stereo pair: in folders left and right
///
/// Files without content are omitted. The folder appears when all files are written; `force`
/// replaces an existing folder. If `stop` returns true, the simulation ends after the current
/// frame. Errors: kBadConfig, kPlugin, kBadData, kCannotCreate, kNotTrusted (an image outside the
/// folder), kIo, ...
SimulateResult Simulate(const Config& config, const PluginHost& host,
                        const std::filesystem::path& folder, bool force,
                        const std::function<bool()>& stop = {}, const SimulateImages& images = {});

}  // namespace alidade
