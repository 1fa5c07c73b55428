// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/config/config.h"
#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"
#include "alidade/report/run_tables.h"

namespace alidade::internal {

/// Returns the object `run` in the data of a page, from some rows of the files. `run` is the
/// content of run.json, and `config` is the root of the resolved config. Returns null if the folder
/// contains no rows. Errors: kInputMissing, kBadData. docs/report.md describes the object.
Json RunData(const std::filesystem::path& folder, const Json& run, const Node& config,
             const RunRows& rows, ColumnPool& pool);

}  // namespace alidade::internal
