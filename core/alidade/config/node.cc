// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/text.h"
#include "alidade/config/read_number.h"
#include "alidade/config/unread_keys.h"

namespace alidade {

using internal::Child;
using internal::FailAt;
using internal::FailMissing;
using internal::Join;
using internal::ListUnread;
using internal::LowerCase;
using internal::PathOf;
using internal::Quoted;

namespace {

std::string FoundText(const ConfigTree& tree) {
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
  if (tree.kind != kind) FailAt(tree.place, PathOf(tree), FoundText(tree), expected);
  return tree;
}

std::string ItemCountText(std::size_t count) {
  return count == 1 ? "1 item" : std::to_string(count) + " items";
}

}  // namespace

Node::Kind Node::kind() const { return tree_->kind; }
bool Node::is_filled() const { return tree_->is_filled; }
const Place& Node::place() const { return tree_->place; }
const std::string& Node::path() const { return PathOf(*tree_); }

Node Node::Root() const {
  const ConfigTree* node = tree_;
  while (node->parent != nullptr) node = node->parent;
  return Node(node);
}

std::optional<Node> Node::Find(std::string_view key) const {
  Declare(key);
  const ConfigTree* child = Child(*tree_, key);
  return child == nullptr ? std::nullopt : std::optional<Node>(Node(child));
}

Node Node::At(std::string_view key, std::string_view needed_by, std::string_view expected) const {
  if (const std::optional<Node> child = Find(key)) return *child;
  FailMissing(*tree_, key, needed_by, expected);
}

void Node::ExpectMap(std::string_view example) const {
  Expect(*tree_, Kind::kMap, ("a map, as in " + std::string(example)).c_str());
}

std::vector<std::pair<std::string, Node>> Node::Entries() const {
  std::vector<std::pair<std::string, Node>> entries;
  for (const auto& child : Expect(*tree_, Kind::kMap, "a map").children) {
    tree_->known_keys.insert(child->key);
    entries.emplace_back(child->key, Node(child.get()));
  }
  return entries;
}

std::vector<Node> Node::Items() const {
  std::vector<Node> items;
  const bool is_scalar = kind() == Kind::kScalar;
  const std::string expected = "a list" + (is_scalar ? ", as in [" + tree_->text + ']' : "");
  for (const auto& child : Expect(*tree_, Kind::kList, expected.c_str()).children) {
    items.emplace_back(child.get());
  }
  return items;
}

std::vector<Node> Node::ItemsOrOne() const {
  return kind() == Kind::kList ? Items() : std::vector<Node>{*this};
}

double Node::Number() const { return internal::ReadNumber(*tree_, "a number"); }

double Node::Number(double low, double high, bool low_open, bool high_open,
                    std::string_view unit) const {
  return internal::ReadNumber(*tree_, low, high, low_open, high_open, unit);
}

std::int64_t Node::Integer(std::int64_t low, std::int64_t high) const {
  return internal::ReadInteger(*tree_, low, high);
}

std::vector<double> Node::Numbers(int size, std::string_view unit) const {
  std::vector<double> numbers;
  if (kind() != Kind::kList) {
    const std::string expected = size < 0 || size == 1
                                     ? "a number or a list of numbers"
                                     : "a list of " + std::to_string(size) + " numbers";
    numbers.push_back(internal::ReadNumber(*tree_, expected, unit));
  } else {
    for (const Node& item : Items()) {
      numbers.push_back(internal::ReadNumber(item.tree(), "a number", unit));
    }
  }
  if (size < 0 && numbers.empty()) Fail("the list is empty", "at least one number");
  if (size >= 0 && numbers.size() != static_cast<std::size_t>(size)) {
    Fail("has " + ItemCountText(numbers.size()), std::to_string(size));
  }
  return numbers;
}

bool Node::Flag() const {
  const ConfigTree& tree = Expect(*tree_, Kind::kScalar, "true or false");
  if (!tree.quoted && tree.text == "true") return true;
  if (!tree.quoted && tree.text == "false") return false;
  const std::string word = LowerCase(tree.text);
  const bool means_true =
      word == "true" || word == "yes" || word == "on" || word == "y" || word == "1";
  const bool means_false =
      word == "false" || word == "no" || word == "off" || word == "n" || word == "0";
  Fail((tree.quoted ? "the text " : "") + Quoted(tree.text), "true or false",
       means_true    ? "true"
       : means_false ? "false"
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
  return Child(map, key) != nullptr && !map.known_keys.contains(std::string(key));
}

void Node::Declare(std::string_view key) const {
  Expect(*tree_, Kind::kMap, "a map").known_keys.emplace(key);
}

void Node::Fail(std::string_view message, std::string_view expected,
                std::string_view suggestion) const {
  FailAt(tree_->place, PathOf(*tree_), message, expected, suggestion);
}

std::string Node::ToYaml() const { return internal::ToYaml(*tree_); }

void internal::ExpectName(const std::string& name, const Node& node, const std::string& owner) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  if (!name.empty() && std::all_of(name.begin(), name.end(), is_allowed)) return;
  node.Fail(Quoted(name) + " is not a valid name for " + owner, "letters, digits, _ and -");
}

}  // namespace alidade
