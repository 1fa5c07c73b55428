// SPDX-License-Identifier: Apache-2.0
#include "excerpt.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>

#include "alidade/base/error.h"

namespace alidade::cli {
namespace {

/// Parses the place at the start of a message. Without such a place, the result has no line.
Place PlaceOf(std::string_view message) {
  constexpr std::size_t kMaxPlace = 1000;
  static const std::regex pattern("^([^\n]+?):([0-9]{1,8}):([0-9]{1,4})[: ]");
  const std::string start(message.substr(0, kMaxPlace));
  std::smatch match;
  if (!std::regex_search(start, match, pattern)) return {};
  return {match[1], std::stoi(match[2]), std::stoi(match[3])};
}

/// Returns line `number` of the file, or "" if the file is not a regular file with this line.
std::string LineOf(const std::string& file, int number) {
  std::error_code error;
  std::string line;
  if (!std::filesystem::is_regular_file(file, error)) return line;
  std::ifstream stream(file, std::ios::binary);
  for (int i = 0; i < number; ++i) {
    line.clear();
    if (!std::getline(stream, line)) return {};
  }
  if (line.ends_with('\r')) line.pop_back();
  std::ranges::replace(line, '\t', ' ');
  return line;
}

/// Returns the number of characters in the first `size` bytes of a UTF-8 text.
std::size_t CharactersIn(const std::string& text, std::size_t size) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text.substr(0, size), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace

std::string Excerpt(std::string_view message) {
  constexpr std::size_t kMaxColumn = 90, kShown = 100;
  const Place place = PlaceOf(message);
  if (place.line == 0) return {};
  std::string line = LineOf(place.file, place.line);
  const auto column = static_cast<std::size_t>(place.column - 1);
  if (line.empty() || column > line.size() || column > kMaxColumn) return {};
  const std::size_t before = CharactersIn(line, column);
  if (line.size() > kShown) line = line.substr(0, kShown - 3) + "...";
  const std::string number = std::to_string(place.line);
  const std::string margin(number.size() + 2, ' ');
  return "  " + number + " | " + line + '\n' + margin + " | " + std::string(before, ' ') + "^\n";
}

}  // namespace alidade::cli
