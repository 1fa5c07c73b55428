// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/frame.h"

namespace alidade {

/// Column that the config names, with its index in the header.
struct CsvColumn {
  std::string name;
  Node node;  ///< node of the config that names the column
  std::size_t index = 0;
};

/// Stream or true value. Each of its columns x provides one number: gain x, or gain / x if
/// `reciprocal` is true.
struct CsvField {
  StreamInfo info;
  std::vector<CsvColumn> columns;
  std::vector<CsvColumn> known;  ///< columns of the known numbers of a measurement
  double gain = 1.0;
  bool reciprocal = false;
  bool goes_blind = false;  ///< true if the stream is dropped after `blind_after`
};

/// Layout of a table according to the config: see kCsvKeys in csv.h.
struct CsvLayout {
  std::optional<CsvColumn> time;  ///< empty if rate_hz determines the times
  std::size_t time_digits = 9;    ///< the unit of time is 10^time_digits ns: 9 for s
  bool time_repeats = false;      ///< true if rows with the same time form one frame
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
