// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"

namespace alidade::internal {
namespace {

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

/// Returns whether all characters of `text` are allowed without quotes, even inside brackets.
bool IsSafeUnquoted(std::string_view text) {
  constexpr std::string_view kInner = "./+-$@ ";
  if (text.empty() || text.back() == ' ') return false;
  return std::all_of(text.begin(), text.end(), [&](char c) {
    return IsLetter(c) || IsDigit(c) || kInner.find(c) != std::string_view::npos;
  });
}

/// Returns whether a YAML reader may read an unquoted `text` as a number, a flag or a null.
bool IsAmbiguous(std::string_view text) {
  constexpr std::array<std::string_view, 8> kWords = {"true", "false", "yes",  "no",
                                                      "on",   "off",   "null", "nan"};
  const std::string word = LowerCase(text);
  return !IsLetter(text[0]) || std::find(kWords.begin(), kWords.end(), word) != kWords.end();
}

std::string DoubleQuoted(std::string_view text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted.append("\\") += c;
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (c == '\t') {
      quoted += "\\t";
    } else if ((c >= 0 && c < ' ') || c == 0x7F) {
      quoted.append("\\x") += kHex[c >> 4];
      quoted += kHex[c & 15];
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string KeyText(const std::string& key) {
  return IsSafeUnquoted(key) && !IsAmbiguous(key) ? key : DoubleQuoted(key);
}

std::string ScalarText(const ConfigTree& tree) {
  const std::string& text = tree.text;
  if (!IsSafeUnquoted(text)) return DoubleQuoted(text);
  if (tree.quoted) return IsAmbiguous(text) ? DoubleQuoted(text) : text;
  const char first = text[0];
  const bool is_number = text.size() > 1 && (first == '-' || first == '+' || first == '.') &&
                         (IsDigit(text[1]) || (text[1] == '.' && first != '.'));
  return IsLetter(first) || IsDigit(first) || is_number ? text : DoubleQuoted(text);
}

bool FitsOneLine(const ConfigTree& tree) {
  if (tree.kind == Node::Kind::kMap) return tree.children.empty();
  return std::all_of(tree.children.begin(), tree.children.end(),
                     [](const auto& child) { return FitsOneLine(*child); });
}

std::string OneLine(const ConfigTree& tree) {
  if (tree.kind == Node::Kind::kNull) return "null";
  if (tree.kind == Node::Kind::kScalar) return ScalarText(tree);
  if (tree.kind == Node::Kind::kMap) return "{}";
  std::string text;
  for (const auto& child : tree.children) text += (text.empty() ? "" : ", ") + OneLine(*child);
  return '[' + text + ']';
}

/// Appends the children of a map or list, each on one or more lines.
void EmitBlock(const ConfigTree& tree, std::size_t indent, std::string* out) {
  for (const auto& child : tree.children) {
    const std::size_t start = out->size();
    if (tree.kind == Node::Kind::kMap) {
      out->append(indent, ' ').append(KeyText(child->key)).append(":");
      if (FitsOneLine(*child)) {
        out->append(" ").append(OneLine(*child)).append("\n");
      } else {
        out->append("\n");
        EmitBlock(*child, indent + 2, out);
      }
    } else if (FitsOneLine(*child)) {
      out->append(indent, ' ').append("- ").append(OneLine(*child)).append("\n");
    } else {
      EmitBlock(*child, indent + 2, out);
      (*out)[start + indent] = '-';
    }
  }
}

}  // namespace

std::string ToYaml(const ConfigTree& root) {
  if (FitsOneLine(root)) return OneLine(root) + "\n";
  std::string out;
  EmitBlock(root, 0, &out);
  return out;
}

}  // namespace alidade::internal
