// SPDX-License-Identifier: Apache-2.0
#include "points.h"

#include <cstdint>
#include <optional>

namespace alidade::scene {
namespace {

/// Uniform on the unit sphere.
Eigen::Vector3d Direction(Random& random) {
  Eigen::Vector3d point;
  do {
    for (int i = 0; i < 3; ++i) point[i] = random.Normal();
  } while (!(point.norm() > 1e-9));
  return point.normalized();
}

/// Points on spheres about `centre`, in turn on each of `radii`.
std::vector<Eigen::Vector3d> OnShells(const Node& node, std::size_t count, Random& random) {
  const Node radii_node = node.At("radii", "shells");
  const std::vector<double> radii = radii_node.Numbers();
  for (const double radius : radii) {
    if (!(radius > 0.0)) radii_node.Fail("a radius that is not positive", "radii > 0, m");
  }
  const auto centre = node.Find("centre");
  const Eigen::Vector3d origin = centre ? ReadVector(*centre) : Eigen::Vector3d::Zero().eval();
  node.RejectUnread();
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(origin + radii[i % radii.size()] * Direction(random));
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
  if (!(max.array() > min.array()).all()) node.At("max").Fail("not above 'min' in x, y and z");
  node.RejectUnread();
}

Eigen::Vector3d Box::Inside(Random& random) const {
  Eigen::Vector3d point;
  for (int i = 0; i < 3; ++i) point[i] = min[i] + (max[i] - min[i]) * random.Uniform();
  return point;
}

Eigen::Vector3d Box::OnFaces(Random& random) const {
  const Eigen::Vector3d size = max - min;
  const double area[3] = {size.y() * size.z(), size.z() * size.x(), size.x() * size.y()};
  double at = (area[0] + area[1] + area[2]) * random.Uniform();
  int axis = 0;  // normal to the face
  while (axis < 2 && at >= area[axis]) at -= area[axis++];
  const bool far = random.Uniform() < 0.5;
  Eigen::Vector3d point = Inside(random);
  point[axis] = far ? max[axis] : min[axis];
  return point;
}

std::pair<std::string, Node> OneOf(const Node& node, const std::vector<std::string>& names) {
  std::string listed;
  for (const std::string& name : names) listed += (listed.empty() ? "" : ", ") + name;
  std::optional<std::pair<std::string, Node>> found;
  for (const std::string& name : names) {
    const auto one = node.Find(name);
    if (one && found) {
      one->Fail("'" + found->first + "' and '" + name + "' are both given", "one of " + listed);
    }
    if (one) found.emplace(name, *one);
  }
  if (!found) {
    node.RejectUnread();  // a key that is nearly one of them
    node.Fail("says nothing of its kind", "one of " + listed);
  }
  return *found;
}

std::vector<Eigen::Vector3d> ReadPoints(const Node& node, Random& random) {
  constexpr std::int64_t kMost = 1'000'000;
  const std::optional<Node> count_node = node.Find("count");
  const auto [kind, what] = OneOf(node, {"list", "box", "room", "shells"});
  std::vector<Eigen::Vector3d> points;
  if (kind == "list") {
    if (count_node) count_node->Fail("a list has its own count", "'list' alone");
    for (const Node& item : what.Items()) points.push_back(ReadVector(item));
    if (points.empty()) what.Fail("no points", "a list of [x, y, z], m");
    return points;
  }
  const Node needed = node.At("count", "points that are drawn");
  const auto count = static_cast<std::size_t>(needed.Integer(1, kMost));
  if (kind == "shells") return OnShells(what, count, random);
  const Box box(what);
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(kind == "box" ? box.Inside(random) : box.OnFaces(random));
  }
  return points;
}

}  // namespace alidade::scene
