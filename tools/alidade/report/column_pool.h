// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/io/json.h"

namespace alidade::internal {

/// Columns of numbers of a page. Equal columns are stored once. The data of the page refer to a
/// column by its index. docs/report.md describes the types of columns.
class ColumnPool {
 public:
  /// Adds numbers with the precision of a float. Values far from zero relative to their range are
  /// stored as differences from an offset.
  int AddNumbers(std::span<const double> values);
  /// Adds numbers for a figure. More than kLongSeries numbers have 16 bits: their sign, and the
  /// logarithm of their magnitude. The relative error is then at most 0.2 %, if the magnitudes
  /// differ by a factor of at most 1e40.
  int AddSeries(std::span<const double> values);
  static constexpr std::size_t kLongSeries = 20'000;
  /// Adds numbers with 16 bits, for clouds of points. `resolution` is the smallest step between
  /// stored values.
  int AddCloud(std::span<const double> values, double resolution = 0.0);
  /// Adds whole numbers from 0 to 2^32 - 1.
  int AddIntegers(std::span<const std::uint32_t> values);
  /// Adds ids: whole numbers from 0 to 2^53. NaN counts as 0.
  int AddIds(std::span<const double> values);
  /// Adds times in seconds after `origin`.
  int AddTimes(std::span<const Timestamp> times, Timestamp origin);
  /// Adds the elements `indices` of column `source`.
  int AddSelection(int source, std::span<const std::uint32_t> indices);

  /// Returns the JSON list of all columns.
  std::string Text() const;

 private:
  int Add(const Json& column);

  std::vector<const std::string*> columns_;  ///< keys of `indices_`, by index
  std::map<std::string, int> indices_;       ///< JSON text of a column -> index
};

}  // namespace alidade::internal
