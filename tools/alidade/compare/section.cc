// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/section.h"

#include "alidade/io/text_table.h"

namespace alidade::internal {
namespace {

std::string PlainText(const Section& section, std::size_t width) {
  std::string text = section.title + '\n';
  for (const std::string& line : section.lines) text += "  " + line + '\n';
  if (section.rows.empty()) return text;
  const Table table = MakeTable(section.columns, section.rows);
  return text + (section.lines.empty() ? "" : "\n") +
         FormatTable(section.transposed ? Transposed(table) : table, TableFormat::kText, width);
}

std::string Markdown(const Section& section) {
  std::string text = "**" + section.title + "**\n\n";
  for (const std::string& line : section.lines) text += "- " + line + '\n';
  if (section.rows.empty()) return text;
  if (!section.lines.empty()) text += '\n';
  return text + FormatTable(MakeTable(section.columns, section.rows), TableFormat::kMarkdown);
}

std::string Latex(const Section& section) {
  std::string text = "\\paragraph{" + LatexText(section.title) + "}\n";
  for (const std::string& line : section.lines) text += LatexText(line) + ".\n";
  if (section.rows.empty()) return text;
  return text + '\n' + FormatTable(MakeTable(section.columns, section.rows), TableFormat::kLatex);
}

}  // namespace

std::string SectionsText(const std::vector<Section>& sections, TableStyle style,
                         std::size_t width) {
  std::string text;
  for (const Section& section : sections) {
    if (!text.empty()) text += '\n';
    text += style == TableStyle::kMarkdown ? Markdown(section)
            : style == TableStyle::kLatex  ? Latex(section)
                                           : PlainText(section, width);
  }
  return text;
}

}  // namespace alidade::internal
