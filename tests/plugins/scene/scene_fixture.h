// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/param_reader.h"
#include "plugins/scene/scene.h"

namespace alidade::testing {

inline const std::string kCamera =
    "camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}\n";
inline const std::string kSweep =
    "trajectory: {look_at: [{position: [-0.5, 0, 0], target: [0, 0, 4]}, "
    "{position: [0.5, 0.1, 0.2], target: [0.3, 0, 4]}]}";
inline const std::string kPoints =
    "points: {box: {min: [-2, -1.5, 2], max: [2, 1.5, 6]}, count: 40}";

/// A scene and the config from which it was created.
struct MadeScene {
  Config config;
  std::unique_ptr<Source> scene;
};

inline MadeScene MakeScene(const std::string& keys, std::uint64_t seed = 1,
                           const std::string& camera = kCamera) {
  MadeScene made{Config::FromText(camera + "source: {" + keys + "}", "run.yaml"), nullptr};
  const Node entry = made.config.root().At("source");
  internal::ParamReader reader(entry, "source 'scene'");
  Params params(&reader.host());
  made.scene = CreateScene({entry, params, seed, {}});
  reader.Check();
  entry.RejectUnread();
  made.config.root().RejectUnread();
  return made;
}

inline std::vector<SourceFrame> SceneFrames(const std::string& keys, std::uint64_t seed = 1,
                                            const std::string& camera = kCamera) {
  const MadeScene made = MakeScene(keys, seed, camera);
  std::vector<SourceFrame> frames;
  for (SourceFrame frame; made.scene->Next(frame);) frames.push_back(frame);
  return frames;
}

}  // namespace alidade::testing
