// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Returns the object `compare` in the data of a page, from the folder of `alidade compare`.
/// `comparison` is the content of compare.json. Errors: kBadData. docs/report.md describes the
/// object.
Json ComparisonData(const std::filesystem::path& folder, const Json& comparison, ColumnPool& pool);

}  // namespace alidade::internal
