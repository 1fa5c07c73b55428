// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/section.h"

#include "alidade/io/text_table.h"
#include "alidade/record/report_html.h"

namespace alidade::internal {
namespace {

std::string PlainText(const Section& section) {
  std::string text = section.title + '\n';
  for (const std::string& line : section.lines) text += "  " + line + '\n';
  if (section.rows.empty()) return text;
  return text + (section.lines.empty() ? "" : "\n") +
         RightAlignedTable(section.columns, section.rows);
}

std::string Markdown(const Section& section) {
  std::string text = "**" + section.title + "**\n\n";
  for (const std::string& line : section.lines) text += "- " + line + '\n';
  if (section.rows.empty()) return text;
  if (!section.lines.empty()) text += '\n';
  return text + MarkdownTable("", section.columns, section.rows);
}

std::string Latex(const Section& section) {
  std::string text = "\\paragraph{" + LatexText(section.title) + "}\n";
  for (const std::string& line : section.lines) text += LatexText(line) + ".\n";
  if (section.rows.empty()) return text;
  text += "\n\\begin{tabular}{l" + std::string(section.columns.size(), 'r') + "}\n\\hline\n";
  text += LatexRow(CellsOf({"", section.columns})) + "\\hline\n";
  for (const TableRow& row : section.rows) text += LatexRow(CellsOf(row));
  return text + "\\hline\n\\end{tabular}\n";
}

std::string Html(const Section& section) {
  std::string text = "<h3>" + HtmlEscaped(section.title) + "</h3>\n";
  for (const std::string& line : section.lines) {
    text += "<p class=\"soft\">" + HtmlEscaped(line) + "</p>\n";
  }
  if (section.rows.empty()) return text;
  const auto row = [](const char* tag, const std::vector<std::string>& cells) {
    std::string line = "<tr>";
    for (const std::string& cell : cells) {
      line.append("<").append(tag).append(">") += HtmlEscaped(cell);
      line.append("</").append(tag).append(">");
    }
    return line + "</tr>\n";
  };
  text += "<div class=\"scroll\"><table>\n" + row("th", CellsOf({"", section.columns}));
  for (const TableRow& one : section.rows) text += row("td", CellsOf(one));
  return text + "</table></div>\n";
}

}  // namespace

std::string SectionsText(const std::vector<Section>& sections, TableStyle style) {
  std::string text;
  for (const Section& section : sections) {
    if (!text.empty()) text += '\n';
    text += style == TableStyle::kMarkdown ? Markdown(section)
            : style == TableStyle::kLatex  ? Latex(section)
            : style == TableStyle::kHtml   ? Html(section)
                                           : PlainText(section);
  }
  return text;
}

}  // namespace alidade::internal
