// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/json_node.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"
#include "alidade/base/text.h"

namespace alidade::internal {

void JsonNode::Fail(const std::string& message, const std::string& expected) const {
  throw Error(ExitCode::kBadData, ErrorLine(Place{file_}, path_, message, expected));
}

void JsonNode::FailKind(const std::string& expected) const {
  constexpr std::size_t kShown = 40;
  const std::string text = json_->dump(-1, ' ', false, Json::error_handler_t::replace);
  Fail(text.size() > kShown ? json_->type_name() : text, expected);
}

JsonNode JsonNode::Child(const Json& json, const std::string& path) const {
  JsonNode node(json, file_);
  node.path_ = path_ + path;
  if (node.path_.starts_with('.')) node.path_.erase(0, 1);
  return node;
}

std::optional<JsonNode> JsonNode::Find(const std::string& key) const {
  if (!json_->is_object()) FailKind("an object");
  const auto found = json_->find(key);
  if (found == json_->end()) return std::nullopt;
  return Child(*found, '.' + key);
}

JsonNode JsonNode::At(const std::string& key) const {
  if (auto node = Find(key)) return *std::move(node);
  Fail("the key '" + key + "' is missing", "an unmodified run folder");
}

std::vector<JsonNode> JsonNode::Items() const {
  if (!json_->is_array()) FailKind("a list");
  std::vector<JsonNode> items;
  for (const Json& item : *json_) {
    items.push_back(Child(item, '[' + std::to_string(items.size()) + ']'));
  }
  return items;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::Entries() const {
  if (!json_->is_object()) FailKind("an object");
  std::vector<std::pair<std::string, JsonNode>> entries;
  for (const auto& [key, value] : json_->items()) {
    entries.emplace_back(key, Child(value, '.' + key));
  }
  return entries;
}

std::string JsonNode::Text() const {
  if (!json_->is_string()) FailKind("a text");
  return json_->get<std::string>();
}

std::vector<std::string> JsonNode::Texts() const {
  std::vector<std::string> texts;
  for (const JsonNode& item : Items()) texts.push_back(item.Text());
  return texts;
}

bool JsonNode::Flag() const {
  if (!json_->is_boolean()) FailKind("true or false");
  return json_->get<bool>();
}

std::int64_t JsonNode::Count(std::int64_t maximum) const {
  // The parser stores a non-negative integer as unsigned. A program may store it as signed.
  const bool is_count = json_->is_number_unsigned() ||
                        (json_->is_number_integer() && json_->get<std::int64_t>() >= 0);
  if (!is_count || json_->get<std::uint64_t>() > static_cast<std::uint64_t>(maximum)) {
    FailKind("a whole number from 0 to " + std::to_string(maximum));
  }
  return json_->get<std::int64_t>();
}

double JsonNode::Number() const {
  if (json_->is_null()) return std::numeric_limits<double>::quiet_NaN();
  if (!json_->is_number()) FailKind("a number or null");
  return json_->get<double>();
}

std::size_t JsonNode::Choice(const std::vector<std::string>& choices) const {
  const auto found = std::ranges::find(choices, Text());
  if (found == choices.end()) FailKind("one of " + Join(choices, ", "));
  return static_cast<std::size_t>(found - choices.begin());
}

}  // namespace alidade::internal
