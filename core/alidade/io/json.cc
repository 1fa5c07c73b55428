// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

/// Returns the reason that the message of a parser error contains, such as `syntax error while
/// parsing value - invalid literal`. Omits the error number and the position, which precede the
/// reason, and the quoted bytes and tokens, which follow the reason.
std::string ReasonOf(const Json::exception& error) {
  const std::string message = error.what();
  const std::size_t position = message.find(": ");
  const std::size_t start = (position == message.npos ? message.find("] ") : position) + 2;
  return message.substr(start, message.find(';', start) - start);
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
    // `byte` is numbered from 1. If the text is incomplete, `byte` is the size of the text plus 1.
    const std::size_t offset =
        std::min(error.byte - std::min<std::size_t>(error.byte, 1), text.size());
    const std::string_view preceding = text.substr(0, offset);
    const auto line = 1 + std::ranges::count(preceding, '\n');
    const std::size_t column = offset - (preceding.rfind('\n') + 1) + 1;
    const Place place{file, static_cast<int>(line), static_cast<int>(column)};
    throw Error(ExitCode::kBadData, ErrorLine(place, {}, ReasonOf(error), "JSON"));
  } catch (const Json::exception& error) {
    // A number exceeds the range of a double. The position of the number is unknown.
    throw Error(ExitCode::kBadData, ErrorLine(Place{file}, {}, ReasonOf(error), "JSON"));
  }
}

}  // namespace alidade::internal
