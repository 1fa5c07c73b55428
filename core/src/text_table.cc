// SPDX-License-Identifier: Apache-2.0
#include "text_table.h"

#include <algorithm>
#include <string_view>

namespace alidade::internal {

std::string TextTable(const std::vector<TextRow>& rows, std::size_t indent) {
  std::vector<std::size_t> widths;
  for (const TextRow& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::vector<bool> used(widths.size(), rows.size() < 2);
  for (std::size_t r = 1; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < rows[r].size(); ++c) used[c] = used[c] || !rows[r][c].empty();
  }
  std::string text;
  for (const TextRow& row : rows) {
    std::string line(indent, ' ');
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (!used[c]) continue;
      line += row[c];
      line.append(widths[c] - row[c].size() + 2, ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

std::string MarkdownRow(const TextRow& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) {
    text += ' ';
    for (const char c : cell) {
      if (c == '|' || c == '\\') text += '\\';
      text += c;
    }
    text += " |";
  }
  return text + '\n';
}

std::string LatexText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '\\') {
      safe += "\\textbackslash{}";
    } else if (c == '^' || c == '~') {
      safe.append("\\") += c;
      safe += "{}";
    } else {
      if (std::string_view("_%&#${}").find(c) != std::string_view::npos) safe += '\\';
      safe += c;
    }
  }
  return safe;
}

std::string LatexRow(const TextRow& cells) {
  TextRow safe;
  for (const std::string& cell : cells) safe.push_back(LatexText(cell));
  return Join(safe, " & ") + " \\\\\n";
}

std::string Join(const std::vector<std::string>& parts, const char* separator) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text.append(i > 0 ? separator : "").append(parts[i]);
  return text;
}

}  // namespace alidade::internal
