// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/io/number_rows.h"

namespace alidade {

/// Reader of rows `frame,feature,dim,value`, ordered by frame. A header line is optional.
///
/// Errors       kBadData with file, line and column; those of NumberRows.
class FeatureRows {
 public:
  static constexpr std::size_t kDims = 4;
  struct Feature {
    std::array<double, kDims> values{};
    std::array<int, kDims> lines{};  ///< line of each value; 0 if the value is missing
  };

  FeatureRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  /// Returns the number of the next frame, or nullopt at the end.
  std::optional<std::int64_t> next_frame() const;
  Place place() const { return {rows_.name(), rows_.line(), 0}; }

  /// Reads the features of `frame`, and returns them by id. If `frame` is not the next frame,
  /// returns an empty map.
  std::map<std::int64_t, Feature> ReadFrame(std::int64_t frame);

  /// Returns the first `size` values of a feature of `frame`, or nullopt if dim 2 or 3 is missing.
  /// Fails if u or v is missing.
  std::optional<std::vector<double>> Values(std::int64_t frame, std::int64_t id,
                                            const Feature& feature, std::size_t size) const;

  [[noreturn]] void FailLine(const std::string& problem, std::string_view expected) const;

 private:
  static constexpr const char* kColumns = "frame,feature,dim,value";
  struct Row {
    std::int64_t frame = -1, feature = 0;
    std::size_t dim = 0;
    double value = 0.0;
    int line = 0;
  };

  /// Reads the next row into next_. At the end next_ is empty.
  void Advance();

  NumberRows rows_;
  std::optional<Row> next_;
};

}  // namespace alidade
