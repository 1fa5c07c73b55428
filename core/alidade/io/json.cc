// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

/// Why the parser gave up, `syntax error while parsing value - invalid literal`: its message
/// without its number and place in front, and without the bytes of the file and the tokens behind.
std::string ReasonOf(const Json::exception& error) {
  const std::string what = error.what();
  const std::size_t place = what.find(": ");
  const std::size_t from = (place == what.npos ? what.find("] ") : place) + 2;
  return what.substr(from, what.find(';', from) - from);
}

}  // namespace

std::string JsonText(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string JsonString(std::string_view text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
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
  } catch (const Json::exception& error) {  // a number that no double holds; it has no place
    throw Error(ExitCode::kBadData, ErrorLine(Place{file}, {}, ReasonOf(error), "JSON"));
  }
}

}  // namespace alidade::internal
