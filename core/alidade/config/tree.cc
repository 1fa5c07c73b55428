// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/tree.h"

#include <algorithm>

#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

std::string Component(const ConfigTree& tree) {
  return tree.index < 0 ? tree.key : '[' + std::to_string(tree.index) + ']';
}

/// Appends an empty node that is marked as filled in. A list has items without keys.
ConfigTree& Append(ConfigTree& parent, const std::string& key) {
  const bool is_item = parent.kind == Node::Kind::kList;
  parent.children.push_back(std::make_unique<ConfigTree>());
  ConfigTree& child = *parent.children.back();
  child.is_filled = true;
  child.place = parent.place;
  child.parent = &parent;
  child.key = key;
  if (is_item) child.index = static_cast<int>(parent.children.size()) - 1;
  child.path = is_item ? PathOf(parent) + Component(child) : PathBelow(PathOf(parent), key);
  return child;
}

void SetText(ConfigTree& node, const std::string& text) {
  node.kind = Node::Kind::kScalar;
  node.text = text;
}

/// Marks `copy` and all nodes below it as filled in, with the key paths of `original`.
void MarkFilled(const ConfigTree& original, ConfigTree& copy) {
  copy.is_filled = true;
  copy.path = PathOf(original);
  for (std::size_t i = 0; i < copy.children.size(); ++i) {
    MarkFilled(*original.children[i], *copy.children[i]);
  }
}

}  // namespace

const std::string& PathOf(const ConfigTree& tree) {
  if (!tree.path.empty()) return tree.path;
  std::string path;
  for (const ConfigTree* node = &tree; node->parent != nullptr; node = node->parent) {
    const bool needs_dot = node->index < 0 && node->parent->parent != nullptr;
    path.insert(0, (needs_dot ? "." : "") + Component(*node));
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

void FillText(ConfigTree& map, const std::string& key, const std::string& text) {
  SetText(Append(map, key), text);
}

void FillNumbers(ConfigTree& map, const std::string& key, const std::vector<double>& values) {
  ConfigTree& node = Append(map, key);
  if (values.size() == 1) return SetText(node, NumberText(values[0]));
  node.kind = Node::Kind::kList;
  for (const double value : values) SetText(Append(node, ""), NumberText(value));
}

void FillCopy(ConfigTree& map, const ConfigTree& value) {
  if (ConfigTree* const existing = Child(map, value.key)) {
    if (existing->kind != Node::Kind::kMap || value.kind != Node::Kind::kMap) return;
    for (const auto& child : value.children) FillCopy(*existing, *child);
    return;
  }
  auto copy = Clone(value);
  copy->parent = &map;
  MarkFilled(value, *copy);
  map.children.push_back(std::move(copy));
}

void FillMap(ConfigTree& node) {
  node.kind = Node::Kind::kMap;
  node.is_filled = true;
  node.text.clear();
  node.children.clear();
}

void Remove(ConfigTree& map, std::string_view key) {
  std::erase_if(map.children, [&](const auto& child) { return child->key == key; });
}

void ExpandNames(ConfigTree& list) {
  if (list.kind != Node::Kind::kList) return;
  for (const auto& child : list.children) {
    if (child->kind != Node::Kind::kScalar) {
      FailAt(child->place, PathOf(*child), "the item of the list is not a name",
             "a name, or a map instead of the list");
    }
    if (Child(list, child->text) != nullptr) {
      FailAt(child->place, PathOf(*child), Quoted(child->text) + " is listed twice",
             "each name only once");
    }
    child->key = std::move(child->text);
    child->index = -1;
    child->key_line = child->place.line;
    child->key_column = child->place.column;
    child->kind = Node::Kind::kMap;
    child->text.clear();
    child->path.clear();
    child->quoted = false;
  }
  list.kind = Node::Kind::kMap;
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

void FailAt(const Place& place, std::string_view key, std::string_view message,
            std::string_view expected, std::string_view suggestion) {
  throw Error(ExitCode::kBadConfig, ErrorLine(place, key, message, expected, suggestion));
}

std::unique_ptr<ConfigTree> Clone(const ConfigTree& tree) {
  auto copy = std::make_unique<ConfigTree>();
  copy->kind = tree.kind;
  copy->quoted = tree.quoted;
  copy->is_verbatim = tree.is_verbatim;
  copy->is_filled = tree.is_filled;
  copy->place = tree.place;
  copy->text = tree.text;
  copy->key = tree.key;
  copy->index = tree.index;
  copy->key_line = tree.key_line;
  copy->key_column = tree.key_column;
  copy->children.reserve(tree.children.size());
  for (const auto& child : tree.children) {
    copy->children.push_back(Clone(*child));
    copy->children.back()->parent = copy.get();
  }
  return copy;
}

}  // namespace alidade::internal
