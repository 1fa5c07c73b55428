// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace alidade::internal {

/// JSON value whose objects preserve the order of their keys. Sources that create or read one
/// include <nlohmann/json.hpp>.
using Json = nlohmann::ordered_json;

/// Returns the text of `json`, indented by two spaces for each level. Doubles read back exactly,
/// numbers that are not finite are null, and bytes that are not UTF-8 become U+FFFD.
std::string JsonText(const Json& json);

/// Returns `text` as a JSON string. If memory runs out, a list or map of Json ends the program,
/// because its destructor allocates. A text that is composed from such strings does not.
std::string JsonString(std::string_view text);

/// Parses `text`, the contents of `file`. Errors: kBadData with line and column.
Json ParseJson(std::string_view text, const std::string& file);

}  // namespace alidade::internal
