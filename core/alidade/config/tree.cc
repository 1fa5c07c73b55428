// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/tree.h"

#include <algorithm>

namespace alidade::internal {
namespace {

std::string Component(const ConfigTree& tree) {
  return tree.index < 0 ? tree.key : '[' + std::to_string(tree.index) + ']';
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
