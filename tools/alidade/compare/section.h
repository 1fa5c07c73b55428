// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/compare/compare.h"
#include "alidade/experiment/metric_rows.h"

namespace alidade::internal {

/// Section of a report: a title, lines of text and a table. Each part may be empty.
struct Section {
  std::string title;
  std::vector<std::string> columns;
  std::vector<TableRow> rows;
  std::vector<std::string> lines;
  bool transposed = false;  ///< true: on a terminal, each element of `columns` is a row
};

/// Formats sections as lines for a terminal of this width, as Markdown, or as LaTeX without
/// packages.
std::string SectionsText(const std::vector<Section>& sections, TableStyle style,
                         std::size_t width = kDefaultTextWidth);

}  // namespace alidade::internal
