// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// Formats a finished or failed run as one line of JSON. The line contains all data of the run that
/// the files of a sweep need. `value` is the value of the varied key, or "" if no key is varied.
std::string RunLine(const std::string& value, const SweepRun& run);

/// Contents of a line that RunLine() has formatted.
struct ParsedRunLine {
  std::string value;
  SweepRun run;
};
/// Parses a line that RunLine() has formatted. Returns nullopt if the line has another form.
std::optional<ParsedRunLine> ReadRunLine(const std::string& line);

}  // namespace alidade::internal
