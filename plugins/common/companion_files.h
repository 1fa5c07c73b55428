// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "alidade/base/number_rows.h"
#include "alidade/model/geometry.h"

/// The files next to a file of tracks, read along with it.
namespace alidade {

/// `frame,t_s` of each frame, both increasing; a header may stand first.
class TimestampRows {
 public:
  TimestampRows(const std::filesystem::path& path, const Place& place, const std::string& key)
      : rows_(path, place, key) {}

  const std::string& name() const { return rows_.name(); }
  int line() const { return rows_.line(); }
  /// The next frame; false at the end.
  bool Next(std::int64_t& frame, Timestamp& timestamp) {
    if (!rows_.Next()) {
      if (line_ == 0) rows_.FailLine("no rows", "a row `frame,t_s` for each frame");
      return false;
    }
    if (line_ == 0 && rows_.text(0) == "frame" && !rows_.Next()) {
      rows_.FailLine("no rows", "a row `frame,t_s` for each frame");
    }
    rows_.ExpectColumns(2, "frame,t_s");
    frame = rows_.Index(0, "frame");
    timestamp = rows_.Time(1, "t_s");
    const std::string before = " line " + std::to_string(line_);
    if (line_ > 0 && frame <= frame_) {
      rows_.FailCell(0, "frame", "is not after that of" + before, "frames in order, each once");
    }
    if (line_ > 0 && timestamp <= timestamp_) {
      rows_.FailCell(1, "t_s", "is not after that of" + before, "times that increase");
    }
    frame_ = frame;
    timestamp_ = timestamp;
    line_ = rows_.line();
    return true;
  }

 private:
  NumberRows rows_;
  std::int64_t frame_ = 0;
  Timestamp timestamp_ = 0;
  int line_ = 0;
};

using OdometryValues = std::array<double, 6>;  ///< vx vy vz, m/s, wx wy wz, rad/s

/// Rows with a frame and six velocities, under a header that names them, in any order of columns.
class OdometryRows {
 public:
  OdometryRows(const std::filesystem::path& path, const Place& place, const std::string& key)
      : rows_(path, place, key) {
    if (!rows_.Next()) rows_.FailLine("no header line", kHeader);
    columns_ = rows_.size();
    for (std::size_t k = 0; k < place_.size(); ++k) {
      for (std::size_t i = 0; i < columns_; ++i) {
        if (rows_.text(i) == kNames[k]) place_[k] = i;
      }
      if (place_[k] == kNone) {
        rows_.FailLine(std::string("no column '") + kNames[k] + "'", kHeader);
      }
    }
    Advance();
  }

  /// The row of `frame`; none where it has none. Frames are asked for in order.
  std::optional<OdometryValues> At(std::int64_t frame) {
    while (has_next_ && next_frame_ <= frame) {
      frame_ = next_frame_;
      values_ = next_;
      Advance();
    }
    return frame_ == frame ? std::optional(values_) : std::nullopt;
  }
  /// The first row after the one of the frame that was asked for last.
  std::optional<OdometryValues> Following() const {
    return has_next_ ? std::optional(next_) : std::nullopt;
  }

 private:
  static constexpr std::size_t kNone = SIZE_MAX;
  static constexpr const char* kNames[] = {"frame",    "vx_m_s",   "vy_m_s",  "vz_m_s",
                                           "wx_rad_s", "wy_rad_s", "wz_rad_s"};
  static constexpr const char* kHeader =
      "a header with frame,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s";

  void Advance() {
    const int line_before = rows_.line();
    const bool first = !has_next_;
    has_next_ = rows_.Next();
    if (!has_next_) return;
    rows_.ExpectColumns(columns_, "as in the header");
    const std::int64_t frame = rows_.Index(place_[0], kNames[0]);
    if (!first && frame <= next_frame_) {
      rows_.FailCell(place_[0], kNames[0],
                     "is not after that of line " + std::to_string(line_before),
                     "frames in order, each once");
    }
    next_frame_ = frame;
    for (std::size_t k = 0; k < next_.size(); ++k) {
      next_[k] = rows_.Number(place_[k + 1], kNames[k + 1]);
    }
  }

  NumberRows rows_;
  std::size_t columns_ = 0;
  std::array<std::size_t, 7> place_{kNone, kNone, kNone, kNone, kNone, kNone, kNone};
  bool has_next_ = false;
  std::int64_t frame_ = -1, next_frame_ = -1;
  OdometryValues values_{}, next_{};
};

/// Where a camera is: world_from_cam.
struct Pose {
  std::array<double, 3> position;
  std::array<double, 4> orientation;  ///< w x y z

  /// The same in the frame of camera `c`: c_from_cam = world_from_c^-1 world_from_cam.
  Pose In(const Pose& c) const {
    Pose pose{};
    const double away[3] = {position[0] - c.position[0], position[1] - c.position[1],
                            position[2] - c.position[2]};
    UnitQuaternion::RotateBack(c.orientation.data(), away, pose.position.data());
    const double back[4] = {c.orientation[0], -c.orientation[1], -c.orientation[2],
                            -c.orientation[3]};
    UnitQuaternion::Multiply(back, orientation.data(), pose.orientation.data());
    return pose;
  }
};

/// A trajectory in the form of TUM: `t x y z qx qy qz qw`, times increasing. Quaternions are
/// refused where they are not of unit length to 1e-3; the run normalises the others.
class TumRows {
 public:
  TumRows(const std::filesystem::path& path, const Place& place, const std::string& key)
      : rows_(path, place, key, ' ') {
    Advance();
  }

  /// The pose nearest to `timestamp`, of two as near the earlier, where it is within `tolerance`.
  /// Timestamps are asked for in order.
  std::optional<Pose> At(Timestamp timestamp, Timestamp tolerance) {
    // Two timestamps may be further apart than one can be.
    const auto off = [timestamp](Timestamp other) {
      const auto [least, most] = std::minmax(timestamp, other);
      return static_cast<std::uint64_t>(most) - static_cast<std::uint64_t>(least);
    };
    while (has_next_ && (!nearest_ || off(timestamp_) < off(nearest_timestamp_))) {
      nearest_ = pose_;
      nearest_timestamp_ = timestamp_;
      Advance();
    }
    return nearest_ && off(nearest_timestamp_) <= static_cast<std::uint64_t>(tolerance)
               ? nearest_
               : std::nullopt;
  }

 private:
  void Advance() {
    const int line_before = rows_.line();
    const bool first = !has_next_;
    const Timestamp before = timestamp_;
    has_next_ = rows_.Next();
    if (!has_next_) return;
    rows_.ExpectColumns(8, "t x y z qx qy qz qw");
    timestamp_ = rows_.Time(0, "t");
    if (!first && timestamp_ <= before) {
      rows_.FailCell(0, "t", "is not after that of line " + std::to_string(line_before),
                     "times that increase");
    }
    const std::array<double, 7> values = PoseNumbers(rows_, kTumPose);
    pose_ = {{values[0], values[1], values[2]}, {values[6], values[3], values[4], values[5]}};
  }

  NumberRows rows_;
  bool has_next_ = false;
  Timestamp timestamp_ = 0;  ///< of the row that was read last
  Pose pose_{};
  Timestamp nearest_timestamp_ = 0;  ///< of the row before it
  std::optional<Pose> nearest_;
};

}  // namespace alidade
