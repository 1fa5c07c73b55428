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

/// Returns one stream for each id of the table of known numbers of `stream`, whose name contains
/// `*`. The id replaces the `*`.
std::vector<TableField> StreamsById(const TableField& stream);

/// Returns true if a reading has the id of `stream`, or if `stream` has readings of all ids. Error:
/// those of KnownNumbers().
bool HasIdOf(const TableRow& reading, const TableField& stream);

/// Returns the known numbers of a reading: those of the row of the table that has its id. Errors:
/// kBadData if there is no such row.
const std::vector<double>& KnownNumbers(const TableRow& reading, const KnownTable& table);

}  // namespace alidade
