// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace alidade::internal {

/// A JSON value whose objects keep the order of their keys. Sources that make or read one include
/// <nlohmann/json.hpp>.
using Json = nlohmann::ordered_json;

/// The text of `json`, two spaces for each level: doubles read back exactly, what is not finite is
/// null, and bytes that are not UTF-8 become U+FFFD.
std::string JsonText(const Json& json);

/// `text` as a string of JSON. A list or map of Json allocates in its destructor, and so ends the
/// program where memory runs out; a text put together from these does not.
std::string JsonString(std::string_view text);

/// The value that `text`, the contents of `file`, is. Errors: kBadData with line and column.
Json ParseJson(std::string_view text, const std::string& file);

}  // namespace alidade::internal
