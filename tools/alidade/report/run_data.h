// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/config/config.h"
#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Returns the object `run` in the data of a page. `run` is the content of run.json, and `config`
/// is the root of the resolved config. Returns null if the folder contains no rows. Errors:
/// kInputMissing, kBadData. docs/report.md describes the object.
Json RunData(const std::filesystem::path& folder, const Json& run, const Node& config,
             ColumnPool& pool);

}  // namespace alidade::internal
