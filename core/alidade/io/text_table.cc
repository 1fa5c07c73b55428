// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/text_table.h"

#include <algorithm>
#include <string_view>

#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

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

std::string MarkdownTable(const Table& table) {
  std::string text = MarkdownRow(table.header) + '|';
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    text += c < table.text_columns ? "---|" : "---:|";
  }
  text += '\n';
  for (const TextRow& row : table.rows) text += MarkdownRow(row);
  return text;
}

std::string LatexRow(const TextRow& cells) {
  TextRow escaped;
  for (const std::string& cell : cells) escaped.push_back(LatexText(cell));
  return Join(escaped, " & ") + " \\\\\n";
}

std::string LatexTable(const Table& table) {
  std::string text = "\\begin{tabular}{" + std::string(table.text_columns, 'l') +
                     std::string(table.header.size() - table.text_columns, 'r') + "}\n\\hline\n" +
                     LatexRow(table.header) + "\\hline\n";
  for (const TextRow& row : table.rows) text += LatexRow(row);
  return text + "\\hline\n\\end{tabular}\n";
}

std::string PlainTable(const Table& table) {
  constexpr std::size_t kLineWidth = 100, kGap = 2;
  std::vector<std::size_t> widths;
  for (const std::string& name : table.header) widths.push_back(name.size());
  for (const TextRow& row : table.rows) {
    for (std::size_t c = 0; c < widths.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  const auto append_line = [&](const TextRow& row, std::size_t first, std::size_t end) {
    text += row[0];
    text.append(widths[0] - row[0].size(), ' ');
    for (std::size_t c = first; c < end; ++c) {
      text.append(kGap + widths[c] - row[c].size(), ' ').append(row[c]);
    }
    text += '\n';
  };
  for (std::size_t first = 1, end = 1; first < widths.size(); first = end) {
    std::size_t width = widths[0];
    for (end = first; end < widths.size(); ++end) {
      width += kGap + widths[end];
      if (width > kLineWidth && end > first) break;
    }
    if (first > 1) text += '\n';
    append_line(table.header, first, end);
    for (const TextRow& row : table.rows) append_line(row, first, end);
  }
  return text;
}

}  // namespace

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

Table MakeTable(const std::vector<std::string>& names, const std::vector<TableRow>& rows,
                const std::string& corner) {
  const auto cells_of = [](const std::string& label, const std::vector<std::string>& cells) {
    TextRow row = {label};
    row.insert(row.end(), cells.begin(), cells.end());
    return row;
  };
  Table table{cells_of(corner, names), {}};
  for (const TableRow& row : rows) table.rows.push_back(cells_of(row.label, row.cells));
  return table;
}

std::string FormatTable(const Table& table, TableFormat format) {
  switch (format) {
    case TableFormat::kMarkdown:
      return MarkdownTable(table);
    case TableFormat::kLatex:
      return LatexTable(table);
    case TableFormat::kText:
      break;
  }
  return PlainTable(table);
}

}  // namespace alidade::internal
