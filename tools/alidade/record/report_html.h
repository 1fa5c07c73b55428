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
  std::string config;  ///< as YAML
  RunFacts facts;
  Figures figures;
  std::map<std::string, std::string> svgs;  ///< by name of the figure
  std::vector<std::string> subjects = {};   ///< SubjectsOf the experiment
};

/// One page with all in it but figure `timing`: no script, no other file, no clock.
std::string ReportHtml(const RunResult& result, const Report& report);

/// `text`, as PrintableUtf8, with the characters that HTML takes for its own replaced.
std::string HtmlEscaped(std::string_view text);

}  // namespace alidade::internal
