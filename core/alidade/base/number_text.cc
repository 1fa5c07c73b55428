// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/number_text.h"

#include <charconv>
#include <cmath>

namespace alidade::internal {

void AppendNumber(std::string& text, double value) {
  if (std::isnan(value)) {
    text += "nan";  // to_chars would also write the sign of NaN, which has no meaning
    return;
  }
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

std::string NumberText(double value) {
  std::string text;
  AppendNumber(text, value);
  return text;
}

std::string FixedText(double value, int decimals) {
  char buffer[512];
  const auto result =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals);
  return {buffer, result.ptr};
}

std::string RoundedText(double value, int digits) {
  char buffer[64];
  const auto result =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits);
  return {buffer, result.ptr};
}

std::string ScientificText(double value, int digits) {
  char buffer[64];
  const auto result =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits);
  return {buffer, result.ptr};
}

std::string SecondsText(Timestamp timestamp) { return FixedText(Seconds(timestamp), 6) + " s"; }

void AppendSeconds(std::string& text, Timestamp timestamp) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  // The magnitude is unsigned, because the magnitude of INT64_MIN does not fit into a Timestamp.
  const std::uint64_t bits = static_cast<std::uint64_t>(timestamp);
  const std::uint64_t magnitude = timestamp < 0 ? 0 - bits : bits;
  if (timestamp < 0) text += '-';
  text += std::to_string(magnitude / kSecond);
  const std::string fraction = std::to_string(magnitude % kSecond);
  text += '.';
  text.append(9 - fraction.size(), '0');
  text += fraction;
}

}  // namespace alidade::internal
