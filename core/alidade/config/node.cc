// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/words.h"
#include "alidade/config/tree.h"

namespace alidade {

using internal::Child;
using internal::FailAt;
using internal::Join;
using internal::KeyPlace;
using internal::PathBelow;
using internal::PathOf;
using internal::Quoted;

namespace internal {
namespace {

std::string Component(const ConfigTree& tree) {
  return tree.index < 0 ? tree.key : '[' + std::to_string(tree.index) + ']';
}

}  // namespace

const std::string& PathOf(const ConfigTree& tree) {
  if (!tree.path.empty()) return tree.path;
  std::string path;
  for (const ConfigTree* at = &tree; at->parent != nullptr; at = at->parent) {
    const bool dot = at->index < 0 && at->parent->parent != nullptr;
    path.insert(0, (dot ? "." : "") + Component(*at));
  }
  return tree.path = path;
}

std::string PathBelow(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : path + '.' + std::string(key);
}

Place KeyPlace(const ConfigTree& tree) {
  if (tree.key_line == 0) return tree.place;
  return Place{tree.place.file, tree.key_line, tree.key_column};
}

ConfigTree* Child(const ConfigTree& map, std::string_view key) {
  for (const auto& child : map.children) {
    if (child->key == key) return child.get();
  }
  return nullptr;
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kShown = 60;
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string quoted = "'";
  std::size_t end = std::min(text.size(), kShown);
  while (end < text.size() && (text[end] & 0xC0) == 0x80) --end;
  for (const char c : text.substr(0, end)) {
    if (c == '\n') {
      quoted += "\\n";
    } else if ((c >= 0 && c < ' ') || c == 0x7F) {
      quoted.append("\\x") += kHex[c >> 4];
      quoted += kHex[c & 15];
    } else {
      quoted += c;
    }
  }
  return quoted + (end < text.size() ? "...'" : "'");
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

void FailAt(const Place& place, std::string_view key, std::string_view what,
            std::string_view expected, std::string_view suggestion) {
  throw Error(ExitCode::kBadConfig, ErrorLine(place, key, what, expected, suggestion));
}

}  // namespace internal

namespace {

struct Unit {
  std::string_view name;
  int dimension;
};

// "min" is left out: in a key it is a minimum more often than a minute.
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

/// `rate_deg_s` as the stem `rate` and the unit `deg_s`.
struct UnitOfKey {
  std::string_view stem;
  std::string_view unit;
  std::vector<int> dimensions;
};

UnitOfKey SplitUnit(std::string_view key) {
  UnitOfKey split{key, {}, {}};
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

/// The unit of `written` where it differs from `known` in its unit alone, as in `baseline_mm` for
/// `baseline_m`; else "". `same_dimension`: only where one unit converts to the other.
std::string UnitSlip(std::string_view written, std::string_view known, bool same_dimension) {
  const UnitOfKey a = SplitUnit(written);
  const UnitOfKey b = SplitUnit(known);
  if (a.unit.empty() || b.unit.empty() || a.stem != b.stem || a.unit == b.unit) return {};
  if (same_dimension && a.dimensions != b.dimensions) return {};
  return std::string(a.unit);
}

std::string Found(const ConfigTree& tree) {
  switch (tree.kind) {
    case Node::Kind::kNull:
      return "no value";
    case Node::Kind::kScalar:
      return Quoted(tree.text);
    case Node::Kind::kList:
      return "a list";
    case Node::Kind::kMap:
      return "a map";
  }
  return {};
}

const ConfigTree& Expect(const ConfigTree& tree, Node::Kind kind, const char* expected) {
  if (tree.kind != kind) FailAt(tree.place, PathOf(tree), Found(tree), expected);
  return tree;
}

[[noreturn]] void FailMissing(const ConfigTree& map, std::string_view key,
                              std::string_view needed_by) {
  std::vector<std::string> unread;
  for (const auto& child : map.children) {
    if (map.asked.contains(child->key)) continue;
    const std::string unit = UnitSlip(child->key, key, true);
    if (!unit.empty()) {
      FailAt(KeyPlace(*child), PathOf(*child), "wrong unit '" + unit + "'", key);
    }
    unread.push_back(child->key);
  }
  std::string what = "missing key";
  if (!needed_by.empty()) what.append(", needed by ").append(needed_by);
  const std::string near = Nearest(key, unread);
  if (!near.empty()) {
    what += "; found '" + near + "'";
    const int line = Child(map, near)->key_line;
    if (line > 0) what += " at line " + std::to_string(line);
  }
  FailAt(KeyPlace(map), PathBelow(PathOf(map), key), what);
}

std::string UnknownKey(const ConfigTree& map, const ConfigTree& child) {
  std::vector<std::string> absent;
  for (const std::string& asked : map.asked) {
    const std::string unit = UnitSlip(child.key, asked, false);
    if (!unit.empty() && Child(map, asked) == nullptr) {
      return ErrorLine(KeyPlace(child), PathOf(child), "wrong unit '" + unit + "'", asked);
    }
    if (Child(map, asked) == nullptr) absent.push_back(asked);
  }
  std::string near = Nearest(child.key, absent);
  if (near.empty()) near = Nearest(child.key, map.asked);
  constexpr std::size_t kListed = 8;
  std::string expected;
  if (near.empty() && !absent.empty() && absent.size() <= kListed) {
    expected = (absent.size() > 1 ? "one of " : "") + Join(absent);
  }
  return ErrorLine(KeyPlace(child), PathOf(child), "unknown key", expected, near);
}

/// A line for each key that was not asked for, of `map` and of the maps in it that were read.
void ListUnread(const ConfigTree& map, std::vector<std::string>& lines) {
  constexpr std::size_t kMaxLines = 20;
  for (const auto& child : map.children) {
    if (lines.size() >= kMaxLines) return;
    if (!map.asked.contains(child->key)) {
      lines.push_back(UnknownKey(map, *child));
    } else if (child->kind == Node::Kind::kMap && !child->asked.empty()) {
      ListUnread(*child, lines);
    }
  }
}

}  // namespace

Node::Kind Node::kind() const { return tree_->kind; }
const Place& Node::place() const { return tree_->place; }
const std::string& Node::path() const { return PathOf(*tree_); }

Node Node::Root() const {
  const ConfigTree* at = tree_;
  while (at->parent != nullptr) at = at->parent;
  return Node(at);
}

std::optional<Node> Node::Find(std::string_view key) const {
  Declare(key);
  const ConfigTree* child = internal::Child(*tree_, key);
  return child == nullptr ? std::nullopt : std::optional<Node>(Node(child));
}

Node Node::At(std::string_view key, std::string_view needed_by) const {
  if (const std::optional<Node> child = Find(key)) return *child;
  FailMissing(*tree_, key, needed_by);
}

std::vector<std::pair<std::string, Node>> Node::Entries() const {
  std::vector<std::pair<std::string, Node>> entries;
  for (const auto& child : Expect(*tree_, Kind::kMap, "a map").children) {
    tree_->asked.insert(child->key);
    entries.emplace_back(child->key, Node(child.get()));
  }
  return entries;
}

std::vector<Node> Node::Items() const {
  std::vector<Node> items;
  for (const auto& child : Expect(*tree_, Kind::kList, "a list").children) {
    items.emplace_back(child.get());
  }
  return items;
}

std::vector<Node> Node::ItemsOrOne() const {
  return kind() == Kind::kList ? Items() : std::vector<Node>{*this};
}

bool Node::Flag() const {
  const ConfigTree& tree = Expect(*tree_, Kind::kScalar, "true or false");
  if (!tree.quoted && tree.text == "true") return true;
  if (!tree.quoted && tree.text == "false") return false;
  const std::string word = internal::LowerCase(tree.text);
  const bool yes = word == "true" || word == "yes" || word == "on" || word == "y" || word == "1";
  const bool no = word == "false" || word == "no" || word == "off" || word == "n" || word == "0";
  Fail((tree.quoted ? "the text " : "") + Quoted(tree.text), "true or false",
       yes  ? "true"
       : no ? "false"
            : "");
}

std::string Node::Text() const { return Expect(*tree_, Kind::kScalar, "text").text; }

int Node::Choice(const std::vector<std::string>& choices) const {
  const std::string expected = (choices.size() > 1 ? "one of " : "") + Join(choices);
  const std::string& text = Expect(*tree_, Kind::kScalar, expected.c_str()).text;
  const auto found = std::find(choices.begin(), choices.end(), text);
  if (found == choices.end()) Fail(Quoted(text), expected, Nearest(text, choices));
  return static_cast<int>(found - choices.begin());
}

void Node::RejectUnread() const {
  std::vector<std::string> lines;
  ListUnread(Expect(*tree_, Kind::kMap, "a map"), lines);
  if (!lines.empty()) throw Error(ExitCode::kBadConfig, Join(lines, "\n"));
}

bool Node::HasUnread(std::string_view key) const {
  const ConfigTree& map = Expect(*tree_, Kind::kMap, "a map");
  return internal::Child(map, key) != nullptr && !map.asked.contains(std::string(key));
}

void Node::Declare(std::string_view key) const {
  Expect(*tree_, Kind::kMap, "a map").asked.emplace(key);
}

void Node::Fail(std::string_view what, std::string_view expected,
                std::string_view suggestion) const {
  FailAt(tree_->place, PathOf(*tree_), what, expected, suggestion);
}

void internal::ExpectName(const std::string& name, const Node& at, const std::string& of) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  if (!name.empty() && std::all_of(name.begin(), name.end(), fits)) return;
  at.Fail(Quoted(name) + " cannot name " + of, "letters, digits, _ and -");
}

}  // namespace alidade
