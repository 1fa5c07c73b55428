// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/io/json.h"

namespace alidade::internal {

/// Value in a JSON file. Stores the file name and the key path for messages, like Node for YAML.
/// The parsed JSON value must outlive the JsonNode. Errors: kBadData with the file, the key path
/// and the expected value.
class JsonNode {
 public:
  JsonNode(const Json& json, std::string file) : json_(&json), file_(std::move(file)) {}

  JsonNode At(const std::string& key) const;
  std::optional<JsonNode> Find(const std::string& key) const;
  std::vector<JsonNode> Items() const;
  std::vector<std::pair<std::string, JsonNode>> Entries() const;

  std::string Text() const;
  std::vector<std::string> Texts() const;
  bool Flag() const;
  /// Returns a whole number from 0 to `maximum`.
  std::int64_t Count(std::int64_t maximum = INT64_MAX) const;
  /// Returns a number. Returns NaN for null, which represents a number that is not finite.
  double Number() const;
  /// Returns the index of the text in `choices`.
  std::size_t Choice(const std::vector<std::string>& choices) const;

 private:
  JsonNode Child(const Json& json, const std::string& path) const;
  [[noreturn]] void Fail(const std::string& message, const std::string& expected) const;
  [[noreturn]] void FailKind(const std::string& expected) const;

  const Json* json_;
  std::string file_;
  std::string path_;
};

}  // namespace alidade::internal
