// SPDX-License-Identifier: Apache-2.0
#include "excerpt.h"

#include <algorithm>

#include "alidade/report/quotation.h"

namespace alidade::cli {
namespace {

/// Returns the number of characters in the first `size` bytes of a UTF-8 text.
std::size_t CharactersIn(const std::string& text, std::size_t size) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text.substr(0, size), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace

std::string Excerpt(std::string_view message) {
  constexpr std::size_t kMaxColumn = 90, kShown = 100;
  const auto quotation = internal::QuotationOf(message, 0, 0);
  if (!quotation || quotation->place.column == 0 || quotation->lines.empty()) return {};
  const Place& place = quotation->place;
  std::string line = quotation->lines.front().second;
  const auto column = static_cast<std::size_t>(place.column - 1);
  if (line.empty() || column > line.size() || column > kMaxColumn) return {};
  const std::size_t before = CharactersIn(line, column);
  if (line.size() > kShown) line = line.substr(0, kShown - 3) + "...";
  const std::string number = std::to_string(place.line);
  const std::string margin(number.size() + 2, ' ');
  return "  " + number + " | " + line + '\n' + margin + " | " + std::string(before, ' ') + "^\n";
}

}  // namespace alidade::cli
