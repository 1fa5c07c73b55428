// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/quotation.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>

namespace alidade::internal {
namespace {

/// Returns the lines `first` to `last` of a file, or nothing if it has no line `number`.
std::vector<std::pair<int, std::string>> LinesOf(const std::string& file, int first, int number,
                                                 int last) {
  std::error_code error;
  std::vector<std::pair<int, std::string>> lines;
  if (!std::filesystem::is_regular_file(file, error)) return lines;
  std::ifstream stream(file, std::ios::binary);
  int index = 0;
  for (std::string line; index < last && std::getline(stream, line);) {
    if (++index < first) continue;
    if (line.ends_with('\r')) line.pop_back();
    std::ranges::replace(line, '\t', ' ');
    lines.emplace_back(index, std::move(line));
  }
  if (index < number) lines.clear();
  return lines;
}

}  // namespace

std::optional<Quotation> QuotationOf(std::string_view message, int before, int after) {
  constexpr std::size_t kMaxPlace = 1000;
  static const std::regex pattern("^([^\n]+?):([0-9]{1,8})(?::([0-9]{1,4}))?[: ]\\s*");
  const std::string start(message.substr(0, kMaxPlace));
  std::smatch match;
  if (!std::regex_search(start, match, pattern)) return std::nullopt;
  Quotation quotation;
  quotation.place = {match[1], std::stoi(match[2]), match[3].matched ? std::stoi(match[3]) : 0};
  quotation.message = message.substr(static_cast<std::size_t>(match.length(0)));
  const int line = quotation.place.line;
  quotation.lines = LinesOf(quotation.place.file, line - before, line, line + after);
  return quotation;
}

}  // namespace alidade::internal
