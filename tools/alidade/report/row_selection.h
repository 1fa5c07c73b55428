// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/report/csv_rows.h"

namespace alidade::internal {

/// Selected rows of a table.
struct RowSelection {
  std::optional<std::vector<std::uint32_t>> rows = {};  ///< sorted indices; nullopt: all rows
  std::size_t last = kAllRows;  ///< only this number of rows at the end of the file is read
};
inline RowSelection LastRows(std::size_t count) { return {.last = count}; }

/// Largest number of rows of a group that a page contains. The page of a longer run has a bounded
/// size.
inline constexpr std::size_t kMaxRows = 55'000;

/// Selects rows of a long table. The rows with equal texts in the columns `group` are a group. Of a
/// group with more than `max_rows` rows, the rows are divided into at most `max_rows` sequences of
/// equal length, and the most important row of each sequence is selected. The importance is the
/// largest number in the columns whose names start with `importance`. If no such column exists, the
/// first row is selected.
RowSelection SelectRows(const std::filesystem::path& file, const std::vector<std::string>& group,
                        const std::string& importance, std::size_t max_rows = kMaxRows);

/// Selects the rows of a table whose times are in the sorted list `times`. Selects all rows of a
/// table with at most kMaxRows rows.
RowSelection SelectTimes(const std::filesystem::path& file, const std::vector<Timestamp>& times);

}  // namespace alidade::internal
