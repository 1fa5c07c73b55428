// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace alidade::internal {

/// JSON value whose objects preserve the order of their keys. A source file that creates or reads a
/// Json includes <nlohmann/json.hpp>.
using Json = nlohmann::ordered_json;

/// Returns the text of `json`, indented by two spaces for each level. The text of a double parses
/// to the same double. Numbers that are not finite become null. Bytes that are not UTF-8 become
/// U+FFFD.
std::string JsonText(const Json& json);

/// Returns `text` as a JSON string. Code that composes its output from such strings needs no Json
/// list or map. The destructor of a Json list or map allocates memory, and crashes the program
/// if memory runs out.
std::string JsonString(std::string_view text);

/// Parses `text`, which was read from `file`. Error: kBadData with the line and column.
Json ParseJson(std::string_view text, const std::string& file);

}  // namespace alidade::internal
