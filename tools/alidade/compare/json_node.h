// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/io/json.h"

namespace alidade::internal {

/// A value of a JSON file that knows its file and key path, for messages: the counterpart of Node.
/// It lives as long as the value. Errors: kBadData with file, key path and what is expected.
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
  /// A whole number from 0 to `most`.
  std::int64_t Count(std::int64_t most = INT64_MAX) const;
  /// NaN for null, which stands for a number that is not finite.
  double Number() const;
  /// The place of the text among `choices`.
  std::size_t Choice(const std::vector<std::string>& choices) const;

 private:
  JsonNode Below(const Json& json, const std::string& path) const;
  [[noreturn]] void Fail(const std::string& what, const std::string& expected) const;
  [[noreturn]] void FailKind(const std::string& expected) const;

  const Json* json_;
  std::string file_;
  std::string path_;
};

}  // namespace alidade::internal
