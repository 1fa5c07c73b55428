// SPDX-License-Identifier: Apache-2.0
#include "report_section.h"

#include "text_table.h"

namespace alidade::internal {
namespace {

std::string PlainText(const Section& section) {
  std::string text = section.title + '\n';
  for (const std::string& line : section.lines) text += "  " + line + '\n';
  if (section.rows.empty()) return text;
  return text + (section.lines.empty() ? "" : "\n") + EstimatorTable(section.columns, section.rows);
}

std::string Markdown(const Section& section) {
  std::string text = "**" + section.title + "**\n\n";
  for (const std::string& line : section.lines) text += "- " + line + '\n';
  if (section.rows.empty()) return text;
  if (!section.lines.empty()) text += '\n';
  text += "|  | " + Join(section.columns, " | ") + " |\n|---|";
  for (std::size_t c = 0; c < section.columns.size(); ++c) text += "---:|";
  text += '\n';
  for (const ComparisonRow& row : section.rows) {
    text += "| " + row.label + " | " + Join(row.cells, " | ") + " |\n";
  }
  return text;
}

/// `text` without what LaTeX would obey.
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

std::string LatexRow(const std::string& label, const std::vector<std::string>& cells) {
  std::string text = LatexText(label);
  for (const std::string& cell : cells) text += " & " + LatexText(cell);
  return text + " \\\\\n";
}

std::string Latex(const Section& section) {
  std::string text = "\\paragraph{" + LatexText(section.title) + "}\n";
  for (const std::string& line : section.lines) text += LatexText(line) + ".\n";
  if (section.rows.empty()) return text;
  text += "\n\\begin{tabular}{l" + std::string(section.columns.size(), 'r') + "}\n\\toprule\n";
  text += LatexRow("", section.columns) + "\\midrule\n";
  for (const ComparisonRow& row : section.rows) text += LatexRow(row.label, row.cells);
  return text + "\\bottomrule\n\\end{tabular}\n";
}

}  // namespace

std::string SectionsText(const std::vector<Section>& sections, TableStyle style) {
  std::string text;
  for (const Section& section : sections) {
    if (!text.empty()) text += '\n';
    text += style == TableStyle::kMarkdown ? Markdown(section)
            : style == TableStyle::kLatex  ? Latex(section)
                                           : PlainText(section);
  }
  return text;
}

}  // namespace alidade::internal
