// SPDX-License-Identifier: Apache-2.0
#include "surfaces.h"

#include <cmath>

#include "points.h"

namespace alidade::scene {
namespace {

/// The six faces of a box.
void AddFaces(const Box& box, double grain_m, std::vector<Rectangle>& to) {
  const Eigen::Vector3d size = box.max - box.min;
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (const double at : {box.min[axis], box.max[axis]}) {
      Eigen::Vector3d corner = box.min;
      corner[axis] = at;
      to.push_back({corner, size[a] * Eigen::Vector3d::Unit(a), size[b] * Eigen::Vector3d::Unit(b),
                    grain_m, to.size()});
    }
  }
}

}  // namespace

std::vector<Rectangle> ReadSurfaces(const Node& list) {
  std::vector<Rectangle> surfaces;
  for (const Node& item : list.Items()) {
    double grain_m = 0.5;
    if (const auto grain = item.Find("grain_m")) {
      grain_m = grain->Number();
      if (!(grain_m > 0.0)) grain->Fail("not positive", "m, > 0");
    }
    const auto [kind, what] = OneOf(item, {"box", "rectangle"});
    if (kind == "box") {
      AddFaces(Box(what), grain_m, surfaces);
    } else {
      const auto read = [&at = what](const char* key) {
        return ReadVector(at.At(key, "a rectangle"));
      };
      const Rectangle one{read("corner"), read("right"), read("down"), grain_m, surfaces.size()};
      const double area = one.right.norm() * one.down.norm();
      if (!(area > 0.0) || std::abs(one.right.dot(one.down)) > 1e-6 * area) {
        what.Fail("'right' and 'down' are not at right angles", "the edges of a rectangle, m");
      }
      what.RejectUnread();
      surfaces.push_back(one);
    }
    item.RejectUnread();
  }
  return surfaces;
}

}  // namespace alidade::scene
