// SPDX-License-Identifier: Apache-2.0
#include "surfaces.h"

#include <cmath>

#include "points.h"

namespace alidade::scene {
namespace {

/// Appends the six faces of a box.
void AddFaces(const Box& box, double grain_m, std::vector<Rectangle>& rectangles) {
  const Eigen::Vector3d size = box.max - box.min;
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (const double coordinate : {box.min[axis], box.max[axis]}) {
      Eigen::Vector3d corner = box.min;
      corner[axis] = coordinate;
      rectangles.push_back({corner, size[a] * Eigen::Vector3d::Unit(a),
                            size[b] * Eigen::Vector3d::Unit(b), grain_m, rectangles.size()});
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
      if (!(grain_m > 0.0)) grain->Fail("this length is not positive", "a length above 0 m");
    }
    const auto [kind, value] = OneOf(item, {"box", "rectangle"});
    if (kind == "box") {
      AddFaces(Box(value), grain_m, surfaces);
    } else {
      const auto read = [&node = value](const char* key) {
        return ReadVector(node.At(key, "a rectangle"));
      };
      const Rectangle rectangle{read("corner"), read("right"), read("down"), grain_m,
                                surfaces.size()};
      const double area = rectangle.right.norm() * rectangle.down.norm();
      if (!(area > 0.0) || std::abs(rectangle.right.dot(rectangle.down)) > 1e-6 * area) {
        value.Fail("'right' and 'down' are not edges of a rectangle",
                   "two perpendicular vectors that are not 0, m");
      }
      value.RejectUnread();
      surfaces.push_back(rectangle);
    }
    item.RejectUnread();
  }
  return surfaces;
}

}  // namespace alidade::scene
