// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "alidade/sweep/sweep.h"

namespace alidade::internal {

/// The text of a run that came to its end or failed, one line of JSON with all that the files of a
/// sweep rest on: `value` is that of the varied key, "" where none is varied.
std::string RunLine(const std::string& value, const SweepRun& run);

/// What such a line says.
struct LineOfRun {
  std::string value;
  SweepRun run;
};
/// None where the line is of another form.
std::optional<LineOfRun> ReadRunLine(const std::string& line);

}  // namespace alidade::internal
