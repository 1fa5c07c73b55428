// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"

/// Points of a scene, read from the config's `source.points`. The id of a point is its index in the
/// list.
namespace alidade::scene {

Eigen::Vector3d ReadVector(const Node& node);

/// Box `{min: [x, y, z], max: [x, y, z]}`.
struct Box {
  Eigen::Vector3d min, max;

  explicit Box(const Node& node);
  /// Returns a random point, uniformly distributed in the volume.
  Eigen::Vector3d PointInside(Random& random) const;
  /// Returns a random point, uniformly distributed on the six faces.
  Eigen::Vector3d PointOnFaces(Random& random) const;
};

/// Returns the key of `names` that `node` contains, and the value of this key. Fails if `node` does
/// not contain exactly one of these keys.
std::pair<std::string, Node> OneOf(const Node& node, const std::vector<std::string>& names);

/// Reads the map `points` of the config, see kSceneKeys. Draws the points with `random`, unless the
/// map lists points. Errors: kBadConfig.
std::vector<Eigen::Vector3d> ReadPoints(const Node& node, Random& random);

}  // namespace alidade::scene
