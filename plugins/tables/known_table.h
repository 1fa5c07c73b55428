// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "table_layout.h"
#include "table_row.h"

namespace alidade {

/// Reads the path and the columns of a table of known numbers. Errors: kBadConfig.
KnownTable ReadKnownTableKeys(const Node& node);

/// Reads the rows of the table, whose path is relative to `folder`. Errors: kBadConfig, kBadData,
/// kInputMissing.
void ReadKnownTable(const std::filesystem::path& folder, KnownTable& table);

/// Returns the known numbers of a reading: those of the row of the table that has its id. Errors:
/// kBadData if there is no such row.
const std::vector<double>& KnownNumbers(const TableRow& reading, const KnownTable& table);

}  // namespace alidade
