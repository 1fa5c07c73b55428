// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/text_table.h"

#include <algorithm>
#include <string_view>

#include "alidade/base/text.h"

namespace alidade::internal {

std::string TextTable(const std::vector<TextRow>& rows, std::size_t indent) {
  std::vector<std::size_t> widths;
  for (const TextRow& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::vector<bool> is_used(widths.size(), rows.size() < 2);
  for (std::size_t r = 1; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < rows[r].size(); ++c) is_used[c] = is_used[c] || !rows[r][c].empty();
  }
  std::string text;
  for (const TextRow& row : rows) {
    std::string line(indent, ' ');
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (!is_used[c]) continue;
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
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\textbackslash{}";
    } else if (c == '^' || c == '~') {
      escaped.append("\\") += c;
      escaped += "{}";
    } else {
      if (std::string_view("_%&#${}").find(c) != std::string_view::npos) escaped += '\\';
      escaped += c;
    }
  }
  return escaped;
}

std::string LatexRow(const TextRow& cells) {
  TextRow escaped;
  for (const std::string& cell : cells) escaped.push_back(LatexText(cell));
  return Join(escaped, " & ") + " \\\\\n";
}

std::string RightAlignedTable(const std::vector<std::string>& names,
                              const std::vector<TableRow>& rows) {
  constexpr std::size_t kLineWidth = 100, kGap = 2;
  std::size_t label_width = 0;
  std::vector<std::size_t> widths;
  for (const std::string& name : names) widths.push_back(name.size());
  for (const TableRow& row : rows) {
    label_width = std::max(label_width, row.label.size());
    for (std::size_t c = 0; c < widths.size(); ++c) {
      widths[c] = std::max(widths[c], row.cells[c].size());
    }
  }
  std::string text;
  for (std::size_t first = 0, end = 0; first < names.size(); first = end) {
    std::size_t width = label_width;
    for (end = first; end < names.size(); ++end) {
      width += kGap + widths[end];
      if (width > kLineWidth && end > first) break;
    }
    if (first > 0) text += '\n';
    const auto append_line = [&](std::string line, const std::vector<std::string>& cells) {
      line.resize(label_width, ' ');
      for (std::size_t c = first; c < end; ++c) {
        line.append(kGap + widths[c] - cells[c].size(), ' ').append(cells[c]);
      }
      text += line + '\n';
    };
    append_line("", names);
    for (const TableRow& row : rows) append_line(row.label, row.cells);
  }
  return text;
}

std::vector<std::string> CellsOf(const TableRow& row) {
  std::vector<std::string> cells = {row.label};
  cells.insert(cells.end(), row.cells.begin(), row.cells.end());
  return cells;
}

std::string MarkdownTable(const std::string& corner, const std::vector<std::string>& names,
                          const std::vector<TableRow>& rows) {
  std::string text = MarkdownRow(CellsOf({corner, names})) + "|---|";
  for (std::size_t c = 0; c < names.size(); ++c) text += "---:|";
  text += '\n';
  for (const TableRow& row : rows) text += MarkdownRow(CellsOf(row));
  return text;
}

}  // namespace alidade::internal
