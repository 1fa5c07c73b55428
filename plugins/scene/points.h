// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/config/config.h"

/// Points of a scene, from the config's `source.points`. The index of a point in the list is its
/// id.
namespace alidade::scene {

Eigen::Vector3d ReadVector(const Node& node);

/// Box `{min: [x, y, z], max: [x, y, z]}`.
struct Box {
  Eigen::Vector3d min, max;

  explicit Box(const Node& node);
  /// Returns a random point, uniform in the volume.
  Eigen::Vector3d PointInside(Random& random) const;
  /// Returns a random point, uniform on the six faces.
  Eigen::Vector3d PointOnFaces(Random& random) const;
};

/// Returns the key of `names` that `node` has, and its value. Fails unless it has exactly one.
std::pair<std::string, Node> OneOf(const Node& node, const std::vector<std::string>& names);

/// Reads the map `points` of the config, see kSceneKeys. Points that are not listed are drawn from
/// `random`. Errors: kBadConfig.
std::vector<Eigen::Vector3d> ReadPoints(const Node& node, Random& random);

}  // namespace alidade::scene
