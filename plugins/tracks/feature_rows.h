// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>

#include "alidade/base/number_rows.h"

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

  FeatureRows(const std::filesystem::path& path, const Place& place, const std::string& key)
      : rows_(path, place, key) {
    Advance();
  }

  /// The frame that comes next; none at the end.
  std::optional<std::int64_t> next_frame() const {
    return next_ ? std::optional(next_->frame) : std::nullopt;
  }
  Place place() const { return {rows_.name(), rows_.line(), 0}; }

  /// The features of `frame`, by id, where it comes next.
  std::map<std::int64_t, Feature> Take(std::int64_t frame) {
    std::map<std::int64_t, Feature> features;
    while (next_ && next_->frame == frame) {
      Feature& feature = features[next_->feature];
      int& line = feature.lines[next_->dim];
      if (line != 0) {
        FailLine("a second value of frame " + std::to_string(frame) + ", feature " +
                     std::to_string(next_->feature) + ", dim " + std::to_string(next_->dim) +
                     "; the first is in line " + std::to_string(line),
                 "one");
      }
      line = next_->line;
      feature.values[next_->dim] = next_->value;
      Advance();
    }
    return features;
  }

  /// The first `size` values of a feature of `frame`. None where one of dims 2 and 3 is not there;
  /// fails without u or v.
  std::optional<std::vector<double>> Values(std::int64_t frame, std::int64_t id,
                                            const Feature& feature, std::size_t size) const {
    for (std::size_t dim = 0; dim < size; ++dim) {
      if (feature.lines[dim] != 0) continue;
      if (dim >= 2) return std::nullopt;
      const int line = *std::max_element(feature.lines.begin(), feature.lines.end());
      throw Error(ExitCode::kBadData,
                  ErrorLine(Place{rows_.name(), line, 0}, {},
                            "feature " + std::to_string(id) + " of frame " + std::to_string(frame) +
                                " has no dim " + std::to_string(dim),
                            "both 0 (u) and 1 (v)"));
    }
    return std::vector<double>(feature.values.begin(),
                               feature.values.begin() + static_cast<std::ptrdiff_t>(size));
  }

  [[noreturn]] void FailLine(const std::string& what, std::string_view expected) const {
    rows_.FailLine(what, expected);
  }

 private:
  static constexpr const char* kColumns = "frame,feature,dim,value";
  struct Row {
    std::int64_t frame = -1, feature = 0;
    std::size_t dim = 0;
    double value = 0.0;
    int line = 0;
  };

  /// Reads the next row into next_; none at the end.
  void Advance() {
    const bool first = !next_;
    if (!rows_.Next()) {
      if (first) FailLine("no rows", std::string("rows ") + kColumns);
      next_.reset();
      return;
    }
    if (first && rows_.text(0) == "frame") {
      rows_.ExpectColumns(kDims, kColumns);
      if (!rows_.Next()) FailLine("no rows", "a row below the header");
    }
    rows_.ExpectColumns(kDims, kColumns);
    Row row{rows_.Index(0, "frame"), rows_.Index(1, "feature"), 0, rows_.Number(3, "value"),
            rows_.line()};
    const std::int64_t dim = rows_.Index(2, "dim");
    if (dim >= static_cast<std::int64_t>(kDims)) {
      rows_.FailCell(2, "dim", "is unknown", "0 u, 1 v, 2 u_right or depth, 3 v_right");
    }
    row.dim = static_cast<std::size_t>(dim);
    if (!first && row.frame < next_->frame) {
      rows_.FailCell(0, "frame", "is before that of line " + std::to_string(next_->line),
                     "frames in order");
    }
    next_ = row;
  }

  NumberRows rows_;
  std::optional<Row> next_;
};

}  // namespace alidade
