// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// Formats a finished or failed run as one line of JSON. The line contains all data from which the
/// files of a sweep are written. `value` is the value of the varied key, "" if no key is varied.
std::string RunLine(const std::string& value, const SweepRun& run);

/// The content of such a line.
struct ParsedRunLine {
  std::string value;
  SweepRun run;
};
/// Parses such a line. Returns nullopt if it has another form.
std::optional<ParsedRunLine> ReadRunLine(const std::string& line);

}  // namespace alidade::internal
