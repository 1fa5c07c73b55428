// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// How the rows of a file of poses are written; each pose is world_from_body.
///
///   kTum    t x y z qx qy qz qw                t in s; blanks between
///   kTum    the same, Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33
///                                              covariances of rotation, rad^2, in the body, and of
///                                              position, m^2, in the world
///   kKitti  r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z    no timestamp
///   kEuroc  t,x,y,z,qw,qx,qy,qz[,...]          t in ns, 8 or 17 columns; commas between
enum class TrajectoryFormat { kDetect, kTum, kKitti, kEuroc };
/// `detect`, `tum`, `kitti`, `euroc`.
const char* ToString(TrajectoryFormat format);

/// Poses of one body in one world, in the order of their timestamps.
struct Trajectory {
  std::string name;  ///< of the file
  TrajectoryFormat format = TrajectoryFormat::kTum;
  std::vector<Timestamp> timestamps;             ///< ascending; empty where the file has none
  Eigen::Matrix3Xd positions;                    ///< m, in the world
  std::vector<Eigen::Quaterniond> orientations;  ///< world_from_body
  /// Of each pose, or empty: of the error in position, in the world, m^2; and of that in
  /// orientation, q_true = q Exp(d), in the body, rad^2.
  std::vector<Eigen::Matrix3d> position_covariances, orientation_covariances;
  int first_line = 0;                 ///< where the first pose is written
  std::vector<std::string> warnings;  ///< what looks wrong in the file, FILE:LINE first

  int size() const { return static_cast<int>(orientations.size()); }
  bool has_timestamps() const { return !timestamps.empty(); }
  bool has_covariances() const { return !position_covariances.empty(); }
  /// Length of the path along the poses [first, last], m.
  double Length(int first, int last) const;
  /// The poses of these indices.
  Trajectory Select(const std::vector<int>& indices) const;
  /// With the quaternions read in the other of the two orders, w first for w last.
  Trajectory WithOtherQuaternionOrder() const;
};

/// Reads a file of poses, or standard input where it is `-`. kDetect takes the format that the
/// first row has by its columns and commas. Blank lines and lines that begin with `#` are left out.
/// KITTI's timestamps are those of NAME_times.txt or times.txt next to NAME.txt, where there is
/// one.
///
/// Warns, with the line, of timestamps of TUM that are no seconds by their size and distance (they
/// are read as what they look like, ns, us or ms), of poses out of order (they are sorted), of
/// duplicate timestamps (all poses are kept), and of a first pose that would be the identity in the
/// other order of the quaternion.
///
/// Errors: kBadData with file, line and column of a row that is none, of a timestamp beyond 292
/// years and of a covariance that is not positive semi-definite; kInputMissing.
Trajectory ReadTrajectory(const std::filesystem::path& file,
                          TrajectoryFormat format = TrajectoryFormat::kDetect);

/// A trajectory to be evaluated, and what lies with it.
struct TrajectoryFile {
  std::filesystem::path file;
  std::string label;                  ///< for tables: the estimator, or the file's name
  std::filesystem::path innovations;  ///< of the estimator that wrote it; or empty
};

/// What `path` means as a reference: the file itself; of a folder truth.tum or groundtruth.tum; of
/// a sequence of EuRoC its state_groundtruth_estimate0. Errors: kInputMissing where a folder has
/// none.
TrajectoryFile ReferenceAt(const std::filesystem::path& path);

/// The truth.tum that a run folder, or the folder that holds an estimator's, has. Errors:
/// kInputMissing where there is none; kUsage where `path` is not a folder.
TrajectoryFile TruthOf(const std::filesystem::path& path);

/// What `path` means as estimates: the file itself; of a run folder, or the folder of an estimator
/// in it, the trajectories of its estimators, with covariances where they are there. Errors:
/// kInputMissing where a folder has none.
std::vector<TrajectoryFile> EstimatesAt(const std::filesystem::path& path);

}  // namespace alidade
