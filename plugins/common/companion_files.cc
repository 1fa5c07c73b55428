// SPDX-License-Identifier: Apache-2.0
#include "plugins/common/companion_files.h"

#include <algorithm>

#include "alidade/model/geometry.h"

namespace alidade {

TimestampRows::TimestampRows(const std::filesystem::path& path, const Place& place,
                             const std::string& key)
    : rows_(path, place, key) {}

bool TimestampRows::Next(std::int64_t& frame, Timestamp& timestamp) {
  if (!rows_.Next()) {
    if (line_ == 0) rows_.FailLine("the file contains no rows", "a row `frame,t_s` for each frame");
    return false;
  }
  if (line_ == 0 && rows_.text(0) == "frame" && !rows_.Next()) {
    rows_.FailLine("the file contains no rows", "a row `frame,t_s` for each frame");
  }
  rows_.ExpectColumns(2, "frame,t_s");
  frame = rows_.Index(0, "frame");
  timestamp = rows_.Time(1, "t_s");
  const std::string previous = " line " + std::to_string(line_);
  if (line_ > 0 && frame <= frame_) {
    rows_.FailCell(0, "frame", "is not larger than in" + previous, "increasing frame numbers");
  }
  if (line_ > 0 && timestamp <= timestamp_) {
    rows_.FailCell(1, "t_s", "is not later than in" + previous, "increasing times");
  }
  frame_ = frame;
  timestamp_ = timestamp;
  line_ = rows_.line();
  return true;
}

OdometryRows::OdometryRows(const std::filesystem::path& path, const Place& place,
                           const std::string& key)
    : rows_(path, place, key) {
  if (!rows_.Next()) rows_.FailLine("the header line is missing", kHeader);
  columns_ = rows_.size();
  for (std::size_t k = 0; k < place_.size(); ++k) {
    for (std::size_t i = 0; i < columns_; ++i) {
      if (rows_.text(i) == kNames[k]) place_[k] = i;
    }
    if (place_[k] == kNone) {
      rows_.FailLine(std::string("there is no column '") + kNames[k] + "'", kHeader);
    }
  }
  Advance();
}

std::optional<OdometryValues> OdometryRows::At(std::int64_t frame) {
  while (has_next_ && next_frame_ <= frame) {
    frame_ = next_frame_;
    values_ = next_;
    Advance();
  }
  return frame_ == frame ? std::optional(values_) : std::nullopt;
}

std::optional<OdometryValues> OdometryRows::Following() const {
  return has_next_ ? std::optional(next_) : std::nullopt;
}

void OdometryRows::Advance() {
  const int line_before = rows_.line();
  const bool first = !has_next_;
  has_next_ = rows_.Next();
  if (!has_next_) return;
  rows_.ExpectColumns(columns_, "as in the header");
  const std::int64_t frame = rows_.Index(place_[0], kNames[0]);
  if (!first && frame <= next_frame_) {
    rows_.FailCell(place_[0], kNames[0],
                   "is not larger than in line " + std::to_string(line_before),
                   "increasing frame numbers");
  }
  next_frame_ = frame;
  for (std::size_t k = 0; k < next_.size(); ++k) {
    next_[k] = rows_.Number(place_[k + 1], kNames[k + 1]);
  }
}

Pose Pose::In(const Pose& c) const {
  Pose pose{};
  const double offset[3] = {position[0] - c.position[0], position[1] - c.position[1],
                            position[2] - c.position[2]};
  UnitQuaternion::RotateBack(c.orientation.data(), offset, pose.position.data());
  const double inverse[4] = {c.orientation[0], -c.orientation[1], -c.orientation[2],
                             -c.orientation[3]};
  UnitQuaternion::Multiply(inverse, orientation.data(), pose.orientation.data());
  return pose;
}

TumRows::TumRows(const std::filesystem::path& path, const Place& place, const std::string& key)
    : rows_(path, place, key, ' ') {
  Advance();
}

std::optional<Pose> TumRows::At(Timestamp timestamp, Timestamp tolerance) {
  // The difference of two timestamps can exceed the range of a timestamp.
  const auto distance = [timestamp](Timestamp candidate) {
    const auto [earlier, later] = std::minmax(timestamp, candidate);
    return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
  };
  while (has_next_ && (!nearest_ || distance(timestamp_) < distance(nearest_timestamp_))) {
    nearest_ = pose_;
    nearest_timestamp_ = timestamp_;
    Advance();
  }
  return nearest_ && distance(nearest_timestamp_) <= static_cast<std::uint64_t>(tolerance)
             ? nearest_
             : std::nullopt;
}

void TumRows::Advance() {
  const int line_before = rows_.line();
  const bool first = !has_next_;
  const Timestamp previous = timestamp_;
  has_next_ = rows_.Next();
  if (!has_next_) return;
  rows_.ExpectColumns(8, "t x y z qx qy qz qw");
  timestamp_ = rows_.Time(0, "t");
  if (!first && timestamp_ <= previous) {
    rows_.FailCell(0, "t", "is not later than in line " + std::to_string(line_before),
                   "increasing times");
  }
  const std::array<double, 7> values = PoseNumbers(rows_, kTumPose);
  pose_ = {{values[0], values[1], values[2]}, {values[6], values[3], values[4], values[5]}};
}

}  // namespace alidade
