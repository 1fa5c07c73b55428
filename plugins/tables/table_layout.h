// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/config/config.h"
#include "alidade/estimation/frame.h"

namespace alidade {

/// Column that the config names, with its index in the header.
struct TableColumn {
  std::string name;
  Node node;  ///< node of the config that names the column
  std::size_t index = 0;
};

/// Rows that a stream uses: those whose cell equals one of the texts, or one of the numbers.
struct RowCondition {
  TableColumn column;
  std::vector<std::string> texts;
};

/// Table of known numbers: a reading has those of the row with its id.
struct KnownTable {
  using Id = std::variant<double, std::string>;
  struct Row {
    int line;
    std::vector<double> numbers;
  };
  Node path;                         ///< node of the config with the path
  TableColumn id;                    ///< column of the id in the table of the readings
  std::vector<TableColumn> columns;  ///< columns of the known numbers
  std::string file;
  std::map<Id, Row> rows;
};

/// Columns with the covariance R of each measurement.
struct CovarianceColumns {
  enum class Form {
    kSigma,     ///< standard deviations
    kVariance,  ///< variances
    kFull,      ///< all elements of R, row by row
    kUpper,     ///< upper triangle of R, row by row
  };
  Form form;
  std::vector<TableColumn> columns;
  std::size_t size;           ///< number of rows of R
  std::vector<double> scale;  ///< factor of each standard deviation
};

/// Conversion of a cell x to a number: gain u x + offset, or gain / (u x) + offset for a
/// reciprocal. u is the value of the unit in SI units.
struct Conversion {
  double unit = 1.0, gain = 1.0, offset = 0.0;
  std::optional<Node> unit_node = {};  ///< node of the config with the unit
};

/// Stream or true value: numbers of each row that the conditions select.
struct TableField {
  StreamInfo info;
  std::vector<TableColumn> columns;
  std::vector<Conversion> conversions;  ///< one for each column
  std::vector<double> constant;         ///< values of a stream without columns
  bool reciprocal = false;
  /// True if the columns are latitude, longitude and perhaps height. Their numbers are then
  /// converted to east, north and up.
  bool geodetic = false;
  std::optional<CovarianceColumns> covariance;
  std::vector<TableColumn> known;         ///< columns of the known numbers of a measurement
  std::optional<KnownTable> known_table;  ///< replaces `known`
  std::optional<KnownTable::Id> id;       ///< only id whose rows the stream uses
  std::optional<TableColumn> landmark, valid;
  std::vector<RowCondition> conditions;
  Timestamp delay = 0;                    ///< time from the measurement to the time of its row
  std::optional<Timestamp> min_interval;  ///< shortest time between rows that the stream uses
  bool goes_blind = false;                ///< true if the stream is dropped after `blind_after`
};

/// Times of the rows of a table.
struct TableTime {
  std::optional<TableColumn> column;  ///< empty if rate_hz determines the times
  std::size_t digits = 9;             ///< the unit of the column is 10^digits ns: 9 for s
  double rate_hz = 0.0;
  Timestamp offset = 0;              ///< added to each time
  bool repeats = false;              ///< true if rows with the same time form one frame
  std::optional<Timestamp> max_gap;  ///< largest step from one row to the next
  bool skips_gaps = false;           ///< true if a row beyond a larger step is skipped
};

/// Layout of one table according to the config: see kTableKeys in tables.h.
struct TableLayout {
  Node entry;  ///< node of the config that describes the table
  TableTime time;
  std::vector<TableField> streams, truths;
  std::vector<std::string> columns;  ///< names of the columns of a table without header
  char separator = '\0';             ///< 0: determined from the table; ' ': blanks and tabs
  std::vector<std::string> missing{""};
  std::optional<Node> blind_after_node;
  double blind_after = 1.0;
};

/// Reads the name of a column or a list of names. Errors: kBadConfig.
std::vector<TableColumn> ReadColumns(const Node& node);

/// Reads all keys of kTableKeys except `path`. Errors: kBadConfig.
TableLayout ReadTableLayout(const Node& entry);

/// Returns the number of columns of the layout that `names` contains.
std::size_t CountColumns(const std::vector<std::string>& names, const TableLayout& layout);

/// Finds the columns of the layout in the header of `file`. Errors: kBadConfig at the place in the
/// config, with the nearest name and the list of columns.
void ResolveColumns(const std::vector<std::string>& names, const std::string& file,
                    TableLayout& layout);

}  // namespace alidade
