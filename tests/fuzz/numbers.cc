// SPDX-License-Identifier: Apache-2.0
//
// The input is a number or timestamp as text. The result is compared with those of the C library
// and of 128-bit integers.
#include <cmath>
#include <cstring>

#include "alidade/base/number_text.h"
#include "alidade/config/config.h"
#include "alidade/io/text_cell.h"
#include "fuzz.h"

namespace alidade::fuzz {
namespace {

__extension__ typedef __int128 Wide;

bool SameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Returns true if the text has the form [+-] digits [. digits] [e [+-] digits], with at least one
/// digit before the exponent.
bool IsDecimal(std::string_view text) {
  const auto skip = [&](std::string_view set) {
    const std::size_t end = std::min(text.find_first_not_of(set), text.size());
    text.remove_prefix(end);
    return end;
  };
  constexpr std::string_view kDigits = "0123456789";
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  std::size_t digits = skip(kDigits);
  if (text.starts_with('.')) {
    text.remove_prefix(1);
    digits += skip(kDigits);
  }
  if (digits == 0 || text.empty()) return digits > 0;
  if (text[0] != 'e' && text[0] != 'E') return false;
  text.remove_prefix(1);
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  return skip(kDigits) > 0 && text.empty();
}

/// Rounds the decimal `text`, which has no exponent, to `digits` decimals. Returns the result as an
/// integer in units of the last decimal. Halves are rounded away from zero.
Wide Exact(std::string_view text, std::size_t digits) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  Wide ten_times = 0;  // ten times the result
  const std::size_t point = std::min(text.find('.'), text.size());
  for (std::size_t i = 0; i < point; ++i) ten_times = 10 * ten_times + (text[i] - '0');
  for (std::size_t i = 0; i <= digits; ++i) {
    const std::size_t at = point + 1 + i;
    ten_times = 10 * ten_times + (at < text.size() ? text[at] - '0' : 0);
  }
  const Wide value = (ten_times + 5) / 10;
  return negative ? -value : value;
}

void CheckNumber(const std::string& text) {
  double value = 0.0;
  const bool read = cell::ParseNumber(text, value) == nullptr;
  char* end = nullptr;
  const double expected = std::strtod(text.c_str(), &end);
  if (!read) {
    const bool out_of_range = std::isinf(expected) || expected == 0.0;
    Require(!IsDecimal(text) || out_of_range, "a valid number is refused");
    return;
  }
  Require(IsDecimal(text) && *end == '\0' && SameBits(value, expected), "a wrong number is read");
  static_cast<void>(Accepts([&] {
    const Config config = Config::FromText("x: " + text, "numbers");
    Require(SameBits(config.root().At("x").Number(), expected), "a config reads a wrong number");
  }));
  for (const std::size_t digits : {0, 3, 6, 9}) {
    const double t_s = value * std::pow(10.0, static_cast<double>(digits) - 9.0);
    if (!(std::abs(t_s) < cell::kTimeLimit)) continue;
    const Timestamp timestamp = cell::ParseTimestamp(text, value, digits);
    if (text.find_first_of("eE") == text.npos)
      Require(timestamp == Exact(text, digits), "a wrong timestamp is read");
  }
}

void CheckTexts(const std::string& bytes) {
  if (bytes.size() < sizeof(double)) return;
  double value = 0.0, again = 0.0;
  Timestamp timestamp = 0;
  std::memcpy(&value, bytes.data(), sizeof value);
  std::memcpy(&timestamp, bytes.data(), sizeof timestamp);
  const std::string text = internal::NumberText(value);
  const bool read = cell::ParseNumber(text, again) == nullptr;
  Require(read == std::isfinite(value), "a written number is refused");
  Require(!read || SameBits(value, again), "a written number is read as another one");
  for (const int decimals : {0, 6, 17}) {
    static_cast<void>(internal::FixedText(value, decimals));
    static_cast<void>(internal::RoundedText(value, decimals));
    static_cast<void>(internal::ScientificText(value, decimals));
  }
  std::string seconds;
  internal::AppendSeconds(seconds, timestamp);
  Require(cell::ParseNumber(seconds, again) == nullptr, "a written timestamp is not a number");
  if (!(std::abs(again) < cell::kTimeLimit)) return;
  Require(cell::ParseTimestamp(seconds, again, 9) == timestamp,
          "a written timestamp is read as another");
}

}  // namespace
}  // namespace alidade::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade::fuzz;
  const std::string input(TextOf(data, size));
  CheckNumber(input.substr(0, input.find('\0')));
  CheckTexts(input);
  return 0;
}
