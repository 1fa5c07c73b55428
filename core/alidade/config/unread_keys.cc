// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/unread_keys.h"

#include <algorithm>

#include "alidade/base/text.h"
#include "alidade/config/unit.h"

namespace alidade::internal {
namespace {

/// Returns the unit of `written` if the two keys differ only by their units, such as `baseline_mm`
/// and `baseline_m`; otherwise returns "". If `same_dimension` is true, both units must also have
/// the same dimension.
std::string WrongUnit(std::string_view written, std::string_view known, bool same_dimension) {
  const KeyParts a = SplitUnit(written);
  const KeyParts b = SplitUnit(known);
  if (a.suffix.empty() || b.suffix.empty() || a.stem != b.stem || a.suffix == b.suffix) return {};
  if (same_dimension && a.unit.dimensions != b.unit.dimensions) return {};
  return std::string(a.suffix);
}

std::string UnknownKey(const ConfigTree& map, const ConfigTree& child) {
  std::vector<std::string> absent;
  for (const std::string& known : map.known_keys) {
    const std::string unit = WrongUnit(child.key, known, false);
    if (!unit.empty() && Child(map, known) == nullptr) {
      return ErrorLine(KeyPlace(child), PathOf(child), "wrong unit '" + unit + "'", known);
    }
    const ConfigTree* const value = Child(map, known);
    if (value == nullptr || value->is_filled) absent.push_back(known);
  }
  std::string nearest = Nearest(child.key, absent);
  if (nearest.empty()) nearest = Nearest(child.key, map.known_keys);
  constexpr std::size_t kListed = 24;
  std::string expected;
  if (nearest.empty() && !map.known_keys.empty() && map.known_keys.size() <= kListed) {
    const std::vector<std::string> known(map.known_keys.begin(), map.known_keys.end());
    expected = (known.size() > 1 ? "one of " : "") + Join(known);
  }
  return ErrorLine(KeyPlace(child), PathOf(child), "unknown key", expected, nearest);
}

}  // namespace

void FailMissing(const ConfigTree& map, std::string_view key, std::string_view needed_by,
                 std::string_view expected) {
  std::vector<std::string> unread;
  for (const auto& child : map.children) {
    if (map.known_keys.contains(child->key)) continue;
    const std::string unit = WrongUnit(child->key, key, true);
    if (!unit.empty()) {
      FailAt(KeyPlace(*child), PathOf(*child), "wrong unit '" + unit + "'", key);
    }
    unread.push_back(child->key);
  }
  std::string message = "missing key";
  if (!needed_by.empty()) message.append(", needed by ").append(needed_by);
  const std::string nearest = Nearest(key, unread);
  if (nearest.empty()) FailAt(KeyPlace(map), PathBelow(PathOf(map), key), message, expected);
  message += "; found '" + nearest + "'";
  const int line = Child(map, nearest)->key_line;
  if (line > 0) message += " at line " + std::to_string(line);
  FailAt(KeyPlace(map), PathBelow(PathOf(map), key), message, {}, key);
}

void ListUnread(const ConfigTree& map, std::vector<std::string>& lines) {
  constexpr std::size_t kMaxLines = 20;
  for (const auto& child : map.children) {
    if (lines.size() >= kMaxLines) return;
    if (!map.known_keys.contains(child->key)) {
      lines.push_back(UnknownKey(map, *child));
    } else if (child->kind == Node::Kind::kMap && !child->known_keys.empty()) {
      ListUnread(*child, lines);
    }
  }
}

}  // namespace alidade::internal
