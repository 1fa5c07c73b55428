// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/unread_keys.h"

#include <algorithm>

#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

struct Unit {
  std::string_view name;
  int dimension;
};

// "min" is omitted, because in a key it means "minimum" more often than "minute".
constexpr Unit kUnits[] = {
    {"m", 0},    {"mm", 0},    {"cm", 0},     {"km", 0},   {"um", 0},  {"nm", 0},  {"in", 0},
    {"inch", 0}, {"ft", 0},    {"s", 1},      {"sec", 1},  {"ms", 1},  {"us", 1},  {"ns", 1},
    {"h", 1},    {"rad", 2},   {"deg", 2},    {"mrad", 2}, {"hz", 3},  {"khz", 3}, {"mhz", 3},
    {"px", 4},   {"pixel", 4}, {"pixels", 4}, {"m2", 5},   {"mm2", 5}, {"cm2", 5}, {"s2", 6},
    {"ms2", 6},  {"px2", 7},   {"rad2", 8},   {"deg2", 8}, {"kg", 9},  {"g", 9},   {"percent", 10},
};

const Unit* FindUnit(std::string_view name) {
  const auto* unit = std::find_if(std::begin(kUnits), std::end(kUnits),
                                  [&](const Unit& u) { return u.name == name; });
  return unit == std::end(kUnits) ? nullptr : unit;
}

/// Parts of a key: `rate_deg_s` has the stem `rate` and the unit `deg_s`.
struct KeyParts {
  std::string_view stem;
  std::string_view unit;
  std::vector<int> dimensions;
};

KeyParts SplitUnit(std::string_view key) {
  KeyParts split{key, {}, {}};
  for (;;) {
    const std::size_t cut = split.stem.rfind('_');
    if (cut == std::string_view::npos || cut == 0) return split;
    const Unit* unit = FindUnit(split.stem.substr(cut + 1));
    if (unit == nullptr) return split;
    split.dimensions.push_back(unit->dimension);
    split.stem = key.substr(0, cut);
    split.unit = key.substr(cut + 1);
  }
}

/// Returns the unit of `written` if the two keys differ only by their units, such as `baseline_mm`
/// and `baseline_m`; otherwise returns "". If `same_dimension` is true, both units must also have
/// the same dimension.
std::string WrongUnit(std::string_view written, std::string_view known, bool same_dimension) {
  const KeyParts a = SplitUnit(written);
  const KeyParts b = SplitUnit(known);
  if (a.unit.empty() || b.unit.empty() || a.stem != b.stem || a.unit == b.unit) return {};
  if (same_dimension && a.dimensions != b.dimensions) return {};
  return std::string(a.unit);
}

std::string UnknownKey(const ConfigTree& map, const ConfigTree& child) {
  std::vector<std::string> absent;
  for (const std::string& known : map.known_keys) {
    const std::string unit = WrongUnit(child.key, known, false);
    if (!unit.empty() && Child(map, known) == nullptr) {
      return ErrorLine(KeyPlace(child), PathOf(child), "wrong unit '" + unit + "'", known);
    }
    if (Child(map, known) == nullptr) absent.push_back(known);
  }
  std::string nearest = Nearest(child.key, absent);
  if (nearest.empty()) nearest = Nearest(child.key, map.known_keys);
  constexpr std::size_t kListed = 8;
  std::string expected;
  if (nearest.empty() && !absent.empty() && absent.size() <= kListed) {
    expected = (absent.size() > 1 ? "one of " : "") + Join(absent);
  }
  return ErrorLine(KeyPlace(child), PathOf(child), "unknown key", expected, nearest);
}

}  // namespace

void FailMissing(const ConfigTree& map, std::string_view key, std::string_view needed_by) {
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
  if (!nearest.empty()) {
    message += "; found '" + nearest + "'";
    const int line = Child(map, nearest)->key_line;
    if (line > 0) message += " at line " + std::to_string(line);
  }
  FailAt(KeyPlace(map), PathBelow(PathOf(map), key), message);
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
