// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/element_names.h"

namespace alidade::internal {

std::vector<std::string> SplitNames(const std::string& names) {
  std::vector<std::string> parts{""};
  for (const char c : names) {
    if (c == ',') {
      parts.emplace_back();
    } else if (c != ' ') {
      parts.back() += c;
    }
  }
  return parts;
}

std::vector<std::string> ElementsOf(const std::string& names, const Geometry& geometry) {
  if (!names.empty()) return SplitNames(names);
  if (geometry.ambient == 1) return {""};
  if (geometry.kind == GeometryKind::kUnitQuaternion) return {"w", "x", "y", "z"};
  if (geometry.kind == GeometryKind::kUnitVector) return {"x", "y", "z"};
  std::vector<std::string> numbers;
  for (int i = 0; i < geometry.ambient; ++i) numbers.push_back(std::to_string(i));
  return numbers;
}

std::vector<std::string> AmbientNames(const std::string& name, const Space& space) {
  const auto size = static_cast<std::size_t>(space.geometry.ambient);
  if (space.elements.size() == size) return ColumnNames(name, space);
  return NumberedNames(name, size);
}

std::vector<std::string> NumberedNames(const std::string& name, std::size_t size) {
  if (size == 1) return {name};
  std::vector<std::string> names;
  for (std::size_t i = 0; i < size; ++i) names.push_back(name + '.' + std::to_string(i));
  return names;
}

std::vector<std::string> TangentNames(const std::string& name, const Space& space) {
  switch (space.geometry.kind) {
    case GeometryKind::kUnitQuaternion:
      return {name + ".rx", name + ".ry", name + ".rz"};
    case GeometryKind::kUnitVector:
      return {name + ".d0", name + ".d1"};
    case GeometryKind::kProduct:
      return NumberedNames(name, static_cast<std::size_t>(space.geometry.tangent));
    case GeometryKind::kVector:
    case GeometryKind::kAngle:
      break;
  }
  return AmbientNames(name, space);
}

}  // namespace alidade::internal
