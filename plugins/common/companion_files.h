// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "alidade/io/number_rows.h"

/// Readers of the files next to a file of tracks. A reader reads its file frame by frame, in step
/// with the tracks.
namespace alidade {

/// Reader of rows `frame,t_s`, one row for each frame. Both columns must increase. A header line is
/// optional.
class TimestampRows {
 public:
  TimestampRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  const std::string& name() const { return rows_.name(); }
  int line() const { return rows_.line(); }
  /// Reads the next frame. Returns false at the end.
  bool Next(std::int64_t& frame, Timestamp& timestamp);

 private:
  NumberRows rows_;
  std::int64_t frame_ = 0;
  Timestamp timestamp_ = 0;
  int line_ = 0;
};

using OdometryValues = std::array<double, 6>;  ///< vx vy vz in m/s, wx wy wz in rad/s

/// Reader of rows with a frame and six velocities. A header names the columns, which can be in any
/// order.
class OdometryRows {
 public:
  OdometryRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  /// Returns the row of `frame`, or nullopt if the file has no row for this frame. `frame` must not
  /// decrease between calls.
  std::optional<OdometryValues> At(std::int64_t frame);
  /// Returns the first row after the frame that was last passed to At().
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

/// Pose of a camera, world_from_cam.
struct Pose {
  std::array<double, 3> position;
  std::array<double, 4> orientation;  ///< quaternion w x y z

  /// Returns the pose in the frame of camera `c`: c_from_cam = world_from_c^-1 world_from_cam.
  Pose In(const Pose& c) const;
};

/// Reader of a trajectory in TUM format: `t x y z qx qy qz qw`, with increasing times. A quaternion
/// is rejected if its length differs from 1 by more than 1e-3. Otherwise the run normalises it.
class TumRows {
 public:
  TumRows(const std::filesystem::path& path, const Place& place, const std::string& key);

  /// Returns the pose nearest in time to `timestamp`, or nullopt if no pose is within `tolerance`.
  /// If two poses are equally near, returns the earlier one. `timestamp` must not decrease between
  /// calls.
  std::optional<Pose> At(Timestamp timestamp, Timestamp tolerance);

 private:
  void Advance();

  NumberRows rows_;
  bool has_next_ = false;
  Timestamp timestamp_ = 0;  ///< time of the last row that was read
  Pose pose_{};
  Timestamp nearest_timestamp_ = 0;  ///< time of the pose nearest_
  std::optional<Pose> nearest_;
};

}  // namespace alidade
