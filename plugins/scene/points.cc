// SPDX-License-Identifier: Apache-2.0
#include "points.h"

#include <cstdint>
#include <optional>

namespace alidade::scene {
namespace {

/// Returns a random direction, uniform on the unit sphere.
Eigen::Vector3d RandomDirection(Random& random) {
  Eigen::Vector3d point;
  do {
    for (int i = 0; i < 3; ++i) point[i] = random.Normal();
  } while (!(point.norm() > 1e-9));
  return point.normalized();
}

/// Returns random points on spheres about the point `centre`. Successive points are on successive
/// spheres of `radii`, cyclically.
std::vector<Eigen::Vector3d> OnShells(const Node& node, std::size_t count, Random& random) {
  const Node radii_node = node.At("radii", "shells");
  const std::vector<double> radii = radii_node.Numbers();
  for (const double radius : radii) {
    if (!(radius > 0.0)) radii_node.Fail("a radius is not positive", "radii > 0, m");
  }
  const auto centre = node.Find("centre");
  const Eigen::Vector3d origin = centre ? ReadVector(*centre) : Eigen::Vector3d::Zero().eval();
  node.RejectUnread();
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(origin + radii[i % radii.size()] * RandomDirection(random));
  }
  return points;
}

}  // namespace

Eigen::Vector3d ReadVector(const Node& node) {
  const std::vector<double> values = node.Numbers(3);
  return {values[0], values[1], values[2]};
}

Box::Box(const Node& node)
    : min(ReadVector(node.At("min", "a box"))), max(ReadVector(node.At("max", "a box"))) {
  if (!(max.array() > min.array()).all()) {
    node.At("max").Fail("'max' does not exceed 'min'", "max > min in each of x, y and z");
  }
  node.RejectUnread();
}

Eigen::Vector3d Box::PointInside(Random& random) const {
  Eigen::Vector3d point;
  for (int i = 0; i < 3; ++i) point[i] = min[i] + (max[i] - min[i]) * random.Uniform();
  return point;
}

Eigen::Vector3d Box::PointOnFaces(Random& random) const {
  const Eigen::Vector3d size = max - min;
  const double areas[3] = {size.y() * size.z(), size.z() * size.x(), size.x() * size.y()};
  double offset = (areas[0] + areas[1] + areas[2]) * random.Uniform();
  int axis = 0;  // axis normal to the face
  while (axis < 2 && offset >= areas[axis]) offset -= areas[axis++];
  const bool is_upper_face = random.Uniform() < 0.5;
  Eigen::Vector3d point = PointInside(random);
  point[axis] = is_upper_face ? max[axis] : min[axis];
  return point;
}

std::pair<std::string, Node> OneOf(const Node& node, const std::vector<std::string>& names) {
  std::string listed;
  for (const std::string& name : names) listed += (listed.empty() ? "" : ", ") + name;
  std::optional<std::pair<std::string, Node>> found;
  for (const std::string& name : names) {
    const auto entry = node.Find(name);
    if (entry && found) {
      entry->Fail("'" + found->first + "' and '" + name + "' are both given",
                  "only one of " + listed);
    }
    if (entry) found.emplace(name, *entry);
  }
  if (!found) {
    node.RejectUnread();  // reports a misspelt key
    node.Fail("a key is missing", "one of " + listed);
  }
  return *found;
}

std::vector<Eigen::Vector3d> ReadPoints(const Node& node, Random& random) {
  constexpr std::int64_t kMaxCount = 1'000'000;
  const std::optional<Node> count_node = node.Find("count");
  const auto [kind, value] = OneOf(node, {"list", "box", "room", "shells"});
  std::vector<Eigen::Vector3d> points;
  if (kind == "list") {
    if (count_node) count_node->Fail("the number of points follows from the list", "only 'list'");
    for (const Node& item : value.Items()) points.push_back(ReadVector(item));
    if (points.empty()) value.Fail("the list is empty", "a list of [x, y, z], m");
    return points;
  }
  const Node count_entry = node.At("count", "points that are drawn");
  const auto count = static_cast<std::size_t>(count_entry.Integer(1, kMaxCount));
  if (kind == "shells") return OnShells(value, count, random);
  const Box box(value);
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(kind == "box" ? box.PointInside(random) : box.PointOnFaces(random));
  }
  return points;
}

}  // namespace alidade::scene
