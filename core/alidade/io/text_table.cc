// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/text_table.h"

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/io/utf8.h"

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

constexpr std::size_t kGap = 2;

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  return lines;
}

/// Splits a header into words. A long name is also split after its points.
std::vector<std::string> WordsOf(const std::string& header) {
  constexpr std::size_t kLong = 12;
  std::string text = header;
  std::ranges::replace(text, ' ', '\n');
  std::vector<std::string> words;
  for (const std::string& word : LinesOf(text)) {
    std::size_t begin = 0;
    const auto next_point = [&] { return word.find('.', begin); };
    for (std::size_t point = next_point(); word.size() > kLong && point != word.npos;
         point = next_point()) {
      words.push_back(word.substr(begin, point + 1 - begin));
      begin = point + 1;
    }
    words.push_back(word.substr(begin));
  }
  return words;
}

/// Column of numbers. Its header may be wrapped, also after the point of a name. The decimal
/// points of its cells are below each other.
class Column {
 public:
  Column(const Table& table, std::size_t index) {
    for (const TextRow& row : table.rows) {
      const std::string& cell = row[index];
      const std::size_t whole = WholeWidth(cell);
      whole_ = std::max(whole_, whole);
      if (whole > 0) fraction_ = std::max(fraction_, TextWidth(cell) - whole);
      width_ = std::max(width_, TextWidth(cell));
    }
    constexpr std::size_t kNarrowest = 12;  // width to which a header may extend a column
    const std::string& header = table.header[index];
    width_ = std::max({width_, whole_ + fraction_, std::min(kNarrowest, TextWidth(header))});
    const std::vector<std::string> words = WordsOf(header);
    for (const std::string& word : words) width_ = std::max(width_, TextWidth(word));
    header_.emplace_back();
    for (const std::string& word : words) {
      std::string& line = header_.back();
      const std::string gap = line.empty() || line.ends_with('.') ? "" : " ";
      if (TextWidth(line + gap + word) <= width_) {
        line += gap + word;
      } else {
        header_.push_back(word);
      }
    }
  }
  std::size_t width() const { return width_; }
  const std::vector<std::string>& header() const { return header_; }
  /// Returns the text of a cell with blanks on both sides.
  std::string Cell(const std::string& cell) const {
    const std::size_t whole = WholeWidth(cell);
    const std::size_t after = whole == 0 ? 0 : fraction_ - (TextWidth(cell) - whole);
    return std::string(width_ - after - TextWidth(cell), ' ') + cell + std::string(after, ' ');
  }

 private:
  /// Returns the number of characters before the decimal point, or 0 if the cell is not a number.
  static std::size_t WholeWidth(const std::string& cell) {
    if (cell == "-") return 1;
    const std::size_t digit = cell.starts_with('-') ? 1 : 0;
    const bool is_number = digit < cell.size() && cell[digit] >= '0' && cell[digit] <= '9';
    return is_number ? std::min(cell.find_first_not_of("0123456789,/", digit), cell.size()) : 0;
  }

  std::size_t whole_ = 0, fraction_ = 0, width_ = 0;
  std::vector<std::string> header_;
};

void AppendLine(std::string line, std::string& text) {
  line.erase(line.find_last_not_of(' ') + 1);
  text += line + '\n';
}

/// Appends the lines of a row: the label, which may have several lines, and the cells in the first.
void AppendRow(const std::string& label, std::size_t label_width, const std::string& cells,
               std::string& text) {
  const std::vector<std::string> lines = LinesOf(WrapText(label, label_width));
  AppendLine(
      lines[0] + std::string(label_width - std::min(label_width, TextWidth(lines[0])), ' ') + cells,
      text);
  for (std::size_t i = 1; i < lines.size(); ++i) AppendLine(lines[i], text);
}

/// Appends the header of the columns [first, end). The last lines of all headers are side by side.
void AppendHeader(const std::string& corner, std::size_t label_width,
                  std::span<const Column> columns, std::string& text) {
  std::size_t height = 1;
  for (const Column& column : columns) height = std::max(height, column.header().size());
  for (std::size_t i = 0; i < height; ++i) {
    std::string cells;
    for (const Column& column : columns) {
      const std::size_t missing = height - column.header().size();
      const std::string line = i < missing ? "" : column.header()[i - missing];
      cells += std::string(kGap + column.width() - TextWidth(line), ' ') + line;
    }
    AppendRow(i + 1 < height ? "" : corner, label_width, cells, text);
  }
}

std::string PlainTable(const Table& table, std::size_t line_width) {
  std::vector<Column> columns;
  std::size_t label_width = TextWidth(table.header[0]), widest = 0;
  for (std::size_t c = 1; c < table.header.size(); ++c) {
    columns.emplace_back(table, c);
    widest = std::max(widest, kGap + columns.back().width());
  }
  for (const TextRow& row : table.rows) label_width = std::max(label_width, TextWidth(row[0]));
  constexpr std::size_t kNarrowest = 12;
  const std::size_t remaining = line_width > widest ? line_width - widest : 0;
  label_width = std::min(label_width, std::max(remaining, kNarrowest));
  std::string text;
  for (std::size_t first = 0, end = 0; first < columns.size(); first = end) {
    std::size_t width = label_width;
    for (end = first; end < columns.size(); ++end) {
      width += kGap + columns[end].width();
      if (width > line_width && end > first) break;
    }
    if (first > 0) text += '\n';
    AppendHeader(table.header[0], label_width, std::span(columns).subspan(first, end - first),
                 text);
    for (const TextRow& row : table.rows) {
      std::string cells;
      for (std::size_t c = first; c < end; ++c) {
        cells += std::string(kGap, ' ') + columns[c].Cell(row[c + 1]);
      }
      AppendRow(row[0], label_width, cells, text);
    }
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

Table Transposed(const Table& table) {
  Table transposed;
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    TextRow row = {table.header[c]};
    for (const TextRow& source : table.rows) row.push_back(source[c]);
    if (c == 0) {
      transposed.header = std::move(row);
    } else {
      transposed.rows.push_back(std::move(row));
    }
  }
  return transposed;
}

std::string FormatTable(const Table& table, TableFormat format, std::size_t width) {
  switch (format) {
    case TableFormat::kMarkdown:
      return MarkdownTable(table);
    case TableFormat::kLatex:
      return LatexTable(table);
    case TableFormat::kText:
      break;
  }
  return PlainTable(table, width);
}

}  // namespace alidade::internal
