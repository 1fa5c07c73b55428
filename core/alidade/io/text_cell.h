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

/// Conversions of the text of a single table cell. They do not depend on the locale.
namespace alidade::cell {

/// Returns `text` without surrounding blanks, and then without surrounding quotes.
inline std::string_view Trim(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(first);
  text = text.substr(0, text.find_last_not_of(" \t") + 1);
  const bool is_quoted = text.size() > 1 && text.front() == '"' && text.back() == '"';
  return is_quoted ? text.substr(1, text.size() - 2) : text;
}

/// Converts all of `text` to a finite number. Returns nullptr on success, else the problem, such as
/// `is not a number`.
inline const char* ParseNumber(std::string_view text, double& value) {
  const bool has_plus = text.starts_with('+');
  if (has_plus) text.remove_prefix(1);
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  if (error == std::errc::invalid_argument || end != last || (has_plus && text.starts_with('-'))) {
    return "is not a number";
  }
  if (error == std::errc::result_out_of_range) return "is too large or too small";
  return std::isfinite(value) ? nullptr : "is not finite";
}

/// Upper bound on the magnitude of a time, in s (292 years). Every time below this bound fits into
/// a Timestamp.
inline constexpr double kTimeLimit = 9.2e9;

/// Returns the timestamp nearest to the time in `text`. `text` is a decimal number without an
/// exponent, in units of 10^digits ns. The magnitude of the time must be below kTimeLimit.
inline Timestamp ExactTimestamp(std::string_view text, std::size_t digits) {
  const bool is_negative = text.starts_with('-');
  if (is_negative || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string_view fraction = text.substr(std::min(point + 1, text.size()));
  Timestamp ns = 0;
  for (const char digit : text.substr(0, point)) ns = 10 * ns + (digit - '0');
  for (std::size_t i = 0; i < digits; ++i) {
    ns = 10 * ns + (i < fraction.size() ? fraction[i] - '0' : 0);
  }
  if (fraction.size() > digits && fraction[digits] >= '5') ++ns;
  return is_negative ? -ns : ns;
}

/// Returns the timestamp for the time in `text`, a number in units of 10^digits ns. `value` is the
/// same number as a double. The result is exact if `text` has no exponent. The magnitude of the
/// time must be below kTimeLimit.
inline Timestamp ParseTimestamp(std::string_view text, double value, std::size_t digits) {
  if (text.find_first_of("eE") == std::string_view::npos) return ExactTimestamp(text, digits);
  return TimestampFromSeconds(value * std::pow(10.0, static_cast<double>(digits) - 9.0));
}

/// Returns at most the first 40 bytes of a cell, for a message. Replaces control characters and
/// invalid bytes by `?`.
inline std::string PrintableStart(std::string_view cell) {
  constexpr std::size_t kMaxSize = 40;
  const std::string start = internal::PrintableUtf8(cell.substr(0, kMaxSize), "");
  return cell.size() > kMaxSize ? start + "..." : start;
}

}  // namespace alidade::cell
