// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/compare/compare.h"
#include "alidade/experiment/metric_rows.h"

namespace alidade::internal {

/// A table below its title, and lines of text; each part may be missing.
struct Section {
  std::string title;
  std::vector<std::string> columns;
  std::vector<TableRow> rows;
  std::vector<std::string> lines;
};

/// All sections, as lines for a terminal, as Markdown, as LaTeX without any package, or as HTML.
std::string SectionsText(const std::vector<Section>& sections, TableStyle style);

}  // namespace alidade::internal
