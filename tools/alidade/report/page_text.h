// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Returns the data of a page as the text of a JSON object, with the facts and results `data`
/// (docs/report.md) and the columns of `pool`.
std::string DataText(const Json& data, const ColumnPool& pool);

/// Returns the page with the facts and results `data` (docs/report.md) and the columns of `pool`.
std::string PageText(const Json& data, const ColumnPool& pool);

/// Returns the data of a page that PageText() has returned, as the text of a JSON object. Its first
/// key is `live` with the value `live`.
std::string LiveDataOf(const std::string& page, const Json& live);

/// Writes `report.html` into an output folder, after all other files.
void WritePage(const OutputFolder& folder);

/// Writes `report.html` and renames the folder. If the page cannot be written, the folder is
/// renamed without it, and the error is thrown afterwards.
void CommitWithPage(OutputFolder& folder);

}  // namespace alidade::internal
