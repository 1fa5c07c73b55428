// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Returns the object `sweep` in the data of a page, from a folder with runs.csv. `sweep` is the
/// content of sweep.json. `run_command` is the command of a run without the varied value and the
/// seed. Returns null if no run is finished. Errors: kBadData. docs/report.md describes the object.
Json SweepData(const std::filesystem::path& folder, const Json& sweep,
               const std::string& run_command, ColumnPool& pool);

}  // namespace alidade::internal
