// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/figures.h"
#include "alidade/record/run_json.h"

namespace alidade::internal {

struct Report {
  std::string title;
  std::string config;  ///< text of the config, YAML
  RunFacts facts;
  Figures figures;
  std::map<std::string, std::string> svgs;  ///< SVG element of each figure; key: name of figure
  std::vector<std::string> subjects = {};   ///< result of SubjectsOf(experiment)
};

/// Returns a self-contained page without scripts and wall-clock times. The page links the figure
/// `timing` instead of containing it.
std::string ReportHtml(const RunResult& result, const Report& report);

/// Converts `text` with PrintableUtf8(), and escapes the special characters of HTML.
std::string HtmlEscaped(std::string_view text);

}  // namespace alidade::internal
