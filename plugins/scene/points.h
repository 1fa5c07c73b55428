// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"

/// The points of a scene, from the config's `source.points`. Their places in the list are ids.
namespace alidade::scene {

Eigen::Vector3d ReadVector(const Node& node);

/// `{min: [x, y, z], max: [x, y, z]}`
struct Box {
  Eigen::Vector3d min, max;

  explicit Box(const Node& node);
  /// Uniform in the volume.
  Eigen::Vector3d Inside(Random& random) const;
  /// Uniform on the six faces.
  Eigen::Vector3d OnFaces(Random& random) const;
};

/// Of the keys in `names` the one that `node` has. Fails where it has none, or two.
std::pair<std::string, Node> OneOf(const Node& node, const std::vector<std::string>& names);

/// The map `points` of the config, see kSceneKeys; what is not given is drawn from `random`.
/// Errors: kBadConfig.
std::vector<Eigen::Vector3d> ReadPoints(const Node& node, Random& random);

}  // namespace alidade::scene
