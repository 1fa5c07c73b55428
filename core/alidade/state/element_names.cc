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
  if (*geometry.row().elements != '\0') return SplitNames(geometry.row().elements);
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
  const Geometry& geometry = space.geometry;
  if (geometry.is_product()) {
    return NumberedNames(name, static_cast<std::size_t>(geometry.tangent));
  }
  if (*geometry.row().tangent_elements == '\0') return AmbientNames(name, space);
  std::vector<std::string> names;
  for (const std::string& element : SplitNames(geometry.row().tangent_elements)) {
    names.push_back(name + '.' + element);
  }
  return names;
}

}  // namespace alidade::internal
