// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"

namespace alidade {

/// Returns the interactive page of a folder of `alidade run`, `compare`, `sweep` or `bundle`: one
/// HTML file that needs no network. Equal folders yield equal bytes.
///
/// The page of a run that failed quotes the lines of the file that the error names, if this file
/// can still be read. Errors: kInputMissing if the folder contains no results; kBadData if a file
/// of the folder is invalid.
std::string ReportPage(const std::filesystem::path& folder);

namespace internal {

class OutputFolder;

/// Returns a page with the facts and results `data` (docs/report.md), without the columns of `pool`.
std::string PageText(const Json& data, const ColumnPool& pool);

/// Writes `report.html` into an output folder, after all other files.
void WritePage(const OutputFolder& folder);

/// Writes `report.html` and renames the folder. If the page cannot be written, the folder is
/// renamed without it, and the error is thrown afterwards.
void CommitWithPage(OutputFolder& folder);

}  // namespace internal
}  // namespace alidade
