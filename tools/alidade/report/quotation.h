// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/error.h"

namespace alidade::internal {

/// Lines of a file to which an error message refers.
struct Quotation {
  Place place;
  std::string message;                             ///< the message without the place
  std::vector<std::pair<int, std::string>> lines;  ///< numbers and texts; empty: file unreadable
};

/// Returns the place of a message that begins with `FILE:LINE:COL`, and the lines of FILE from
/// `before` lines above this place to `after` lines below. Returns nullopt if the message does not
/// begin with a place. The lines are empty if FILE is not a regular file that contains the line.
std::optional<Quotation> QuotationOf(std::string_view message, int before, int after);

}  // namespace alidade::internal
