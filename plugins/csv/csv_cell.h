// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "alidade/source.h"

/// What the text of a single cell means.
namespace alidade::csv_detail {

/// Without blanks around it, and then without quotes.
inline std::string_view Trim(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(first);
  text = text.substr(0, text.find_last_not_of(" \t") + 1);
  const bool quoted = text.size() > 1 && text.front() == '"' && text.back() == '"';
  return quoted ? text.substr(1, text.size() - 2) : text;
}

/// The nearest ns to a decimal number without exponent, in a unit of 10^digits ns.
inline Stamp ExactStamp(std::string_view text, std::size_t digits) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string_view fraction = text.substr(std::min(point + 1, text.size()));
  Stamp ns = 0;
  for (const char digit : text.substr(0, point)) ns = 10 * ns + (digit - '0');
  for (std::size_t i = 0; i < digits; ++i) {
    ns = 10 * ns + (i < fraction.size() ? fraction[i] - '0' : 0);
  }
  if (fraction.size() > digits && fraction[digits] >= '5') ++ns;
  return negative ? -ns : ns;
}

/// The start of a cell for a message, without control characters.
inline std::string Harmless(std::string_view cell) {
  constexpr std::size_t kShown = 40;
  std::string shown(cell.substr(0, kShown));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7F) c = '?';
  }
  return cell.size() > kShown ? shown + "..." : shown;
}

}  // namespace alidade::csv_detail
