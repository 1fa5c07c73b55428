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
  bool stopped = false;            ///< true: the simulation was stopped early
  std::vector<std::string> files;  ///< names of the files in the folder
};

/// Names of the outputs with camera images, in the folder of the data. An empty name requests no
/// output.
struct SimulateImages {
  std::string video;   ///< name of a video file, NAME.avi
  std::string folder;  ///< name of a folder of PNG files, one for each frame
};

/// Writes the data of the source of `config` to `folder`, without an estimator. The source `tracks`
/// can read these files. The files also contain the truth.
///
///   file              rows
///   timestamps.csv    frame,t_s
///   STREAM.csv        stream of landmarks: frame,feature,dim,value; other stream: frame,t_s and
///                     the values
///   truth.csv         t_s and the values of all truths
///   truth.tum         t x y z qx qy qz qw of the first truth X.position with an X.orientation
///   map.csv           feature,x,y,z, m: true positions of measured landmarks, if known
///   calibration.yaml  section `camera` of the config, which another config can include
///   simulate.json     {"status": "ok", or "stopped" before the end, "frames": N}
///   images.video      MJPG video with an image of each frame. The source draws the images. If the
///                     source cannot draw, equal discs mark the first two values (u, v), px, of the
///                     landmark measurements. Section `camera` of the config then determines the
///                     size of the images. Stereo pair: NAME_left.avi, NAME_right.avi
///   images.folder     the same images as NUMBER.png; stereo pair: in the folders left and right
///
/// Files without content are omitted. The folder appears after all files have been written. `force`
/// replaces an existing folder. If `stop` returns true, the simulation ends after the current
/// frame. Errors: kBadConfig, kPlugin, kBadData, kCannotCreate, kNotTrusted (an image outside the
/// folder), kIo, ...
SimulateResult Simulate(const Config& config, const PluginHost& host,
                        const std::filesystem::path& folder, bool force,
                        const std::function<bool()>& stop = {}, const SimulateImages& images = {});

}  // namespace alidade
