// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <system_error>

#include "alidade/base/timestamp.h"
#include "alidade/io/utf8.h"

/// What the text of a single cell of a table means, whatever the locale.
namespace alidade::cell {

/// Without blanks around it, and then without quotes.
inline std::string_view Trim(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(first);
  text = text.substr(0, text.find_last_not_of(" \t") + 1);
  const bool quoted = text.size() > 1 && text.front() == '"' && text.back() == '"';
  return quoted ? text.substr(1, text.size() - 2) : text;
}

/// The finite number that `text` is, in full; else what is wrong with it, as in `is not a number`.
/// nullptr: nothing.
inline const char* ParseNumber(std::string_view text, double& value) {
  const bool plus = text.starts_with('+');
  if (plus) text.remove_prefix(1);
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  if (error == std::errc::invalid_argument || end != last || (plus && text.starts_with('-'))) {
    return "is not a number";
  }
  if (error == std::errc::result_out_of_range) return "is too large or too small";
  return std::isfinite(value) ? nullptr : "is not finite";
}

/// Times of a size below this, s, are timestamps (292 years).
inline constexpr double kTimeLimit = 9.2e9;

/// The nearest ns to a decimal number without exponent, in a unit of 10^digits ns, of a time below
/// kTimeLimit.
inline Timestamp ExactTimestamp(std::string_view text, std::size_t digits) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string_view fraction = text.substr(std::min(point + 1, text.size()));
  Timestamp ns = 0;
  for (const char digit : text.substr(0, point)) ns = 10 * ns + (digit - '0');
  for (std::size_t i = 0; i < digits; ++i) {
    ns = 10 * ns + (i < fraction.size() ? fraction[i] - '0' : 0);
  }
  if (fraction.size() > digits && fraction[digits] >= '5') ++ns;
  return negative ? -ns : ns;
}

/// The timestamp that `text` writes in a unit of 10^digits ns, `value` being the number it is;
/// exact where it has no exponent. The time is below kTimeLimit.
inline Timestamp ParseTimestamp(std::string_view text, double value, std::size_t digits) {
  if (text.find_first_of("eE") == std::string_view::npos) return ExactTimestamp(text, digits);
  return TimestampFromSeconds(value * std::pow(10.0, static_cast<double>(digits) - 9.0));
}

/// The start of a cell for a message: UTF-8 without control characters.
inline std::string Harmless(std::string_view cell) {
  constexpr std::size_t kShown = 40;
  const std::string shown = internal::ShownUtf8(cell.substr(0, kShown), "");
  return cell.size() > kShown ? shown + "..." : shown;
}

}  // namespace alidade::cell
