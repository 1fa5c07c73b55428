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

/// Rows `frame,feature,dim,value`, frame by frame; a header line may stand first.
///
/// Errors       kBadData with file, line and column; those of NumberRows.
class FeatureRows {
 public:
  static constexpr std::size_t kDims = 4;
  struct Feature {
    std::array<double, kDims> values{};
    std::array<int, kDims> lines{};  ///< where they stand; 0: not there
  };

  FeatureRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  /// The frame that comes next; none at the end.
  std::optional<std::int64_t> next_frame() const;
  Place place() const { return {rows_.name(), rows_.line(), 0}; }

  /// The features of `frame`, by id, where it comes next.
  std::map<std::int64_t, Feature> Take(std::int64_t frame);

  /// The first `size` values of a feature of `frame`. None where one of dims 2 and 3 is not there;
  /// fails without u or v.
  std::optional<std::vector<double>> Values(std::int64_t frame, std::int64_t id,
                                            const Feature& feature, std::size_t size) const;

  [[noreturn]] void FailLine(const std::string& what, std::string_view expected) const;

 private:
  static constexpr const char* kColumns = "frame,feature,dim,value";
  struct Row {
    std::int64_t frame = -1, feature = 0;
    std::size_t dim = 0;
    double value = 0.0;
    int line = 0;
  };

  /// Reads the next row into next_; none at the end.
  void Advance();

  NumberRows rows_;
  std::optional<Row> next_;
};

}  // namespace alidade
