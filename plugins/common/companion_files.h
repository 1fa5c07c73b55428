// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "alidade/io/number_rows.h"

/// The files next to a file of tracks, read along with it.
namespace alidade {

/// `frame,t_s` of each frame, both increasing; a header may stand first.
class TimestampRows {
 public:
  TimestampRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  const std::string& name() const { return rows_.name(); }
  int line() const { return rows_.line(); }
  /// The next frame; false at the end.
  bool Next(std::int64_t& frame, Timestamp& timestamp);

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
  OdometryRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  /// The row of `frame`; none where it has none. Frames are asked for in order.
  std::optional<OdometryValues> At(std::int64_t frame);
  /// The first row after the one of the frame that was asked for last.
  std::optional<OdometryValues> Following() const;

 private:
  static constexpr std::size_t kNone = SIZE_MAX;
  static constexpr const char* kNames[] = {"frame",    "vx_m_s",   "vy_m_s",  "vz_m_s",
                                           "wx_rad_s", "wy_rad_s", "wz_rad_s"};
  static constexpr const char* kHeader =
      "a header with frame,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s";

  void Advance();

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
  Pose In(const Pose& c) const;
};

/// A trajectory in the form of TUM: `t x y z qx qy qz qw`, times increasing. Quaternions are
/// refused where they are not of unit length to 1e-3; the run normalises the others.
class TumRows {
 public:
  TumRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  /// The pose nearest to `timestamp`, of two as near the earlier, where it is within `tolerance`.
  /// Timestamps are asked for in order.
  std::optional<Pose> At(Timestamp timestamp, Timestamp tolerance);

 private:
  void Advance();

  NumberRows rows_;
  bool has_next_ = false;
  Timestamp timestamp_ = 0;  ///< of the row that was read last
  Pose pose_{};
  Timestamp nearest_timestamp_ = 0;  ///< of the row before it
  std::optional<Pose> nearest_;
};

}  // namespace alidade
