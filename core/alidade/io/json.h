// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace alidade::internal {

/// JSON value whose objects preserve the order of their keys. A source file that creates or reads a
/// Json includes <nlohmann/json.hpp>.
using Json = nlohmann::ordered_json;

/// Returns the text of `json`, indented by two spaces for each level. Doubles are read back
/// exactly. Numbers that are not finite become null, and bytes that are not UTF-8 become U+FFFD.
std::string JsonText(const Json& json);

/// Returns `text` as a JSON string. The destructor of a Json list or map allocates memory, and ends
/// the program if none is left. Texts that are composed from such strings avoid this.
std::string JsonString(std::string_view text);

/// Parses `text`, the contents of `file`. Errors: kBadData with the line and column.
Json ParseJson(std::string_view text, const std::string& file);

}  // namespace alidade::internal
