// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/value_labels.h"

#include <algorithm>

namespace alidade::internal {
namespace {

constexpr std::size_t kLongest = 24;

/// Returns the entries of a list or map, without its brackets. Returns any other text as one entry.
std::vector<std::string> EntriesOf(std::string text) {
  const bool bracketed = text.size() > 1 && (text.front() == '{' || text.front() == '[');
  if (bracketed) text = text.substr(1, text.size() - 2);
  std::vector<std::string> entries(1);
  int depth = 0;
  for (const char c : text) {
    if (c == '{' || c == '[') ++depth;
    if (c == '}' || c == ']') --depth;
    if (c == ',' && depth == 0) {
      entries.emplace_back();
    } else if (c != ' ' || !entries.back().empty()) {
      entries.back() += c;
    }
  }
  return entries;
}

std::string Shortened(const std::string& text) {
  return text.size() <= kLongest ? text : text.substr(0, kLongest - 3) + "...";
}

}  // namespace

std::vector<std::string> ValueLabels(const std::vector<std::string>& values) {
  const auto is_short = [](const std::string& value) { return value.size() <= kLongest; };
  if (std::ranges::all_of(values, is_short)) return values;
  std::vector<std::vector<std::string>> entries;
  for (const std::string& value : values) entries.push_back(EntriesOf(value));
  std::vector<std::string> labels;
  for (const std::vector<std::string>& mine : entries) {
    std::string label;
    for (const std::string& entry : mine) {
      const bool in_all = std::ranges::all_of(
          entries, [&](const auto& other) { return std::ranges::count(other, entry) > 0; });
      if (!in_all) label += (label.empty() ? "" : ", ") + entry;
    }
    labels.push_back(Shortened(label));
  }
  return labels;
}

}  // namespace alidade::internal
