// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/frame.h"

namespace alidade {

/// Column that the config names, and its index in the header.
struct CsvColumn {
  std::string name;
  Node node;  ///< place in the config
  std::size_t index = 0;
};

/// Stream or truth value: v = gain x, or gain / x, for each of its columns.
struct CsvField {
  StreamInfo info;
  std::vector<CsvColumn> columns;
  std::vector<CsvColumn> known;  ///< unchanged numbers that belong to each measurement
  double gain = 1.0;
  bool reciprocal = false;
  bool goes_blind = false;  ///< dropped after `blind_after`
};

/// Layout of a table according to the config: see kCsvKeys in csv.h.
struct CsvLayout {
  std::optional<CsvColumn> time;  ///< empty if the rate is rate_hz
  std::size_t time_digits = 9;    ///< decimal digits from the unit of time to ns
  bool time_repeats = false;      ///< consecutive rows of one time are one frame
  double rate_hz = 0.0;
  std::vector<CsvField> streams, truths;
  char separator = ',';
  std::vector<std::string> missing{""};
  std::optional<Node> blind_after_node;
  double blind_after = 1.0;
};

/// Reads all keys of kCsvKeys except `path`. Errors: kBadConfig.
CsvLayout ReadCsvLayout(const Node& entry);

/// Finds the columns of the layout in the header of `file`. Errors: kBadConfig at the place in the
/// config, with the nearest name and the list of columns.
void ResolveColumns(const std::vector<std::string>& names, const std::string& file,
                    CsvLayout& layout);

}  // namespace alidade
