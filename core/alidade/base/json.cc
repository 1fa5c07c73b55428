// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

/// Why the parser gave up: its message without its number and place, `[...] parse error at line 1,
/// column 5: syntax error while parsing value - ...`.
std::string ReasonOf(const Json::parse_error& error) {
  const std::string_view what = error.what();
  const std::size_t colon = what.find(": ");
  return std::string(colon == what.npos ? what : what.substr(colon + 2));
}

}  // namespace

std::string JsonText(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

Json ParseJson(std::string_view text, const std::string& file) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    // `byte` counts from 1 and is one beyond the end where the text is cut short.
    const std::size_t at = std::min(error.byte - std::min<std::size_t>(error.byte, 1), text.size());
    const std::string_view before = text.substr(0, at);
    const auto line = 1 + std::ranges::count(before, '\n');
    const std::size_t column = at - (before.rfind('\n') + 1) + 1;
    const Place place{file, static_cast<int>(line), static_cast<int>(column)};
    throw Error(ExitCode::kBadData, ErrorLine(place, {}, ReasonOf(error), "JSON"));
  }
}

}  // namespace alidade::internal
