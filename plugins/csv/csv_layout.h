// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/frame.h"

namespace alidade {

/// A column that the config names, and where the header has it.
struct CsvColumn {
  std::string name;
  Node node;  ///< where the config says so
  std::size_t index = 0;
};

/// A stream or truth value: v = gain x, or gain / x, of each of its columns.
struct CsvField {
  StreamInfo info;
  std::vector<CsvColumn> columns;
  std::vector<CsvColumn> known;  ///< taken as they are, with each measurement
  double gain = 1.0;
  bool reciprocal = false;
  bool goes_blind = false;  ///< dropped from `blind_after` on
};

/// What the config says of a table: see kCsvKeys in csv.h.
struct CsvLayout {
  std::optional<CsvColumn> time;  ///< none: rows come at rate_hz
  std::size_t time_digits = 9;    ///< decimal digits from the unit of time to ns
  bool time_repeats = false;      ///< rows of one time, one after the other, are one frame
  double rate_hz = 0.0;
  std::vector<CsvField> streams, truths;
  char separator = ',';
  std::vector<std::string> missing{""};
  std::optional<Node> blind_after_node;
  double blind_after = 1.0;
};

/// Reads all keys of kCsvKeys but `path`. Errors: kBadConfig.
CsvLayout ReadCsvLayout(const Node& entry);

/// Finds the columns of the layout in the header of `file`. Errors: kBadConfig at the config's
/// place, with the nearest name and the list of columns.
void ResolveColumns(const std::vector<std::string>& names, const std::string& file,
                    CsvLayout& layout);

}  // namespace alidade
