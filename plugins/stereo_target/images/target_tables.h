// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "alidade/io/number_rows.h"

/// Readers of the tables next to the images of a target. A reader reads its table row by row, in
/// step with the images.
namespace alidade {

/// Reader of the boxes of the target: rows `frame,x,y,width,height` or `frame,x0,y0,...,x3,y3`, px.
/// The corners are clockwise from the upper left. Frames count from 0 and must increase. A row with
/// `nan` values marks the target as not visible. A header is optional.
class BoxRows {
 public:
  using Corners = std::array<cv::Point2f, 4>;

  BoxRows(const std::filesystem::path& path, const Place& place, const std::string& key)
      : rows_(path, place, key) {
    Advance();
    if (!has_next_) rows_.FailLine("the file contains no rows", kFormats);
  }

  /// Row of one frame.
  struct Row {
    std::optional<Corners> corners;  ///< empty if the target is not visible
  };
  /// Returns the row of `frame`, or nullopt if the table has no such row. `frame` must not decrease
  /// between calls.
  std::optional<Row> At(std::int64_t frame) {
    while (has_next_ && next_frame_ < frame) Advance();
    return has_next_ && next_frame_ == frame ? std::optional(Row{next_}) : std::nullopt;
  }
  static Corners FromBox(double x, double y, double width, double height) {
    const auto left = static_cast<float>(x), top = static_cast<float>(y);
    const auto right = static_cast<float>(x + width - 1.0);
    const auto bottom = static_cast<float>(y + height - 1.0);
    return {cv::Point2f(left, top), {right, top}, {right, bottom}, {left, bottom}};
  }

 private:
  static constexpr const char* kFormats = "frame,x,y,width,height or frame and four corners";

  void Advance() {
    const int line_before = rows_.line();
    const bool first = !has_next_;
    has_next_ = rows_.Next() && (line_before > 0 || rows_.text(0) != "frame" || rows_.Next());
    if (!has_next_) return;
    if (rows_.size() != 5) rows_.ExpectColumns(9, kFormats);
    const std::int64_t frame = rows_.Index(0, "frame");
    if (!first && frame <= next_frame_) {
      rows_.FailCell(0, "frame", "is not larger than in line " + std::to_string(line_before),
                     "increasing frame numbers");
    }
    next_frame_ = frame;
    next_.reset();
    if (rows_.text(1) == "nan") return;
    std::vector<double> numbers;
    for (std::size_t i = 1; i < rows_.size(); ++i) {
      const char* const name = kNames[rows_.size() == 5 ? i - 1 : i + 3];
      numbers.push_back(rows_.Number(i, name));
      if (std::abs(numbers.back()) > 1e5)
        rows_.FailCell(i, name, "is outside any image", "a position in the image, px");
    }
    if (numbers.size() == 4) {
      for (const std::size_t side : {2, 3}) {
        if (!(numbers[side] >= 4.0)) {
          rows_.FailCell(side + 1, kNames[side], "is less than 4 px", "a box of at least 4 x 4 px");
        }
      }
      next_ = FromBox(numbers[0], numbers[1], numbers[2], numbers[3]);
      return;
    }
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i] = {static_cast<float>(numbers[2 * i]), static_cast<float>(numbers[2 * i + 1])};
    }
    const std::vector<cv::Point2f> outline(corners.begin(), corners.end());
    if (!cv::isContourConvex(outline) || !(cv::contourArea(outline, true) >= 16.0)) {
      rows_.FailLine("the four corners are not in order, or have no area",
                     "clockwise from the upper left: x0,y0,...,x3,y3");
    }
    next_ = corners;
  }

  static constexpr const char* kNames[] = {"x",  "y",  "width", "height", "x0", "y0",
                                           "x1", "y1", "x2",    "y2",     "x3", "y3"};

  NumberRows rows_;
  bool has_next_ = false;
  std::int64_t next_frame_ = -1;
  std::optional<Corners> next_;
};

/// Reader of true values under a header `t_s,NAME,...`. Each value is a number, and times increase.
/// An empty cell marks an unknown value.
class TruthRows {
 public:
  TruthRows(const std::filesystem::path& path, const Place& place, const std::string& key)
      : rows_(path, place, key) {
    if (!rows_.Next() || rows_.text(0) != "t_s" || rows_.size() < 2) {
      rows_.FailLine("the header is missing", "t_s,NAME,... with the names of the true values");
    }
    for (std::size_t i = 1; i < rows_.size(); ++i) names_.emplace_back(rows_.text(i));
    Advance();
  }

  const std::vector<std::string>& names() const { return names_; }
  /// Returns the values of the row nearest to `timestamp`, if this row is within `tolerance`. If
  /// two rows are equally near, the earlier row is used. An empty vector marks an unknown value.
  /// `timestamp` must not decrease between calls.
  std::vector<std::vector<double>> At(Timestamp timestamp, Timestamp tolerance) {
    // The distance is a floating-point number, because a difference of integers could overflow.
    const auto distance = [timestamp](Timestamp candidate) {
      return 1e-9 * std::abs(static_cast<double>(timestamp) - static_cast<double>(candidate));
    };
    while (has_next_ && (!has_nearest_ || distance(timestamp_) < distance(nearest_timestamp_))) {
      nearest_ = values_;
      nearest_timestamp_ = timestamp_;
      has_nearest_ = true;
      Advance();
    }
    if (has_nearest_ && distance(nearest_timestamp_) <= Seconds(tolerance)) return nearest_;
    return std::vector<std::vector<double>>(names_.size());
  }

 private:
  void Advance() {
    const int line_before = rows_.line();
    const Timestamp previous = timestamp_;
    const bool first = !has_next_;
    has_next_ = rows_.Next();
    if (!has_next_) return;
    rows_.ExpectColumns(names_.size() + 1, "as in the header");
    timestamp_ = rows_.Time(0, "t_s");
    if (!first && timestamp_ <= previous) {
      rows_.FailCell(0, "t_s", "is not later than in line " + std::to_string(line_before),
                     "increasing times");
    }
    values_.clear();
    for (std::size_t i = 0; i < names_.size(); ++i) {
      values_.emplace_back();
      if (!rows_.text(i + 1).empty()) values_.back() = {rows_.Number(i + 1, names_[i].c_str())};
    }
  }

  NumberRows rows_;
  std::vector<std::string> names_;
  bool has_next_ = false, has_nearest_ = false;
  Timestamp timestamp_ = 0, nearest_timestamp_ = 0;
  std::vector<std::vector<double>> values_, nearest_;
};

}  // namespace alidade
