// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Format of the rows of a pose file; each pose is world_from_body.
///
///   kTum    t x y z qx qy qz qw                t in s; separated by blanks
///   kTum    t x y z qx qy qz qw Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33
///                                              covariances of rotation, rad^2, in the body, and of
///                                              position, m^2, in the world
///   kKitti  r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z    no timestamp
///   kEuroc  t,x,y,z,qw,qx,qy,qz[,...]          t in ns, 8 or 17 columns; separated by commas
enum class TrajectoryFormat { kDetect, kTum, kKitti, kEuroc };
/// Returns `detect`, `tum`, `kitti` or `euroc`.
const char* ToString(TrajectoryFormat format);

/// Poses of one body in one world, in the order of their timestamps.
struct Trajectory {
  std::string name;  ///< name of the file
  TrajectoryFormat format = TrajectoryFormat::kTum;
  std::vector<Timestamp> timestamps;             ///< ascending; empty if the file has none
  Eigen::Matrix3Xd positions;                    ///< m, in the world
  std::vector<Eigen::Quaterniond> orientations;  ///< world_from_body
  /// Covariances of each pose, or empty: of the position error, in the world, m^2; of the
  /// orientation error d, q_true = q Exp(d), in the body, rad^2.
  std::vector<Eigen::Matrix3d> position_covariances, orientation_covariances;
  int first_line = 0;                 ///< line of the first pose
  std::vector<std::string> warnings;  ///< suspicious contents of the file, as FILE:LINE: text

  int size() const { return static_cast<int>(orientations.size()); }
  bool has_timestamps() const { return !timestamps.empty(); }
  bool has_covariances() const { return !position_covariances.empty(); }
  /// Returns the length of the trajectory along the poses [first, last], m.
  double Length(int first, int last) const;
  /// Returns the poses with these indices.
  Trajectory Select(const std::vector<int>& indices) const;
  /// Returns the trajectory with quaternions in the other order: w first instead of last, or last
  /// instead of first.
  Trajectory WithOtherQuaternionOrder() const;
};

/// Reads a pose file, or standard input if `file` is `-`. kDetect selects the format by the number
/// of columns and the commas of the first row. Blank lines and lines that begin with `#` are
/// skipped. Timestamps of KITTI are read from NAME_times.txt or times.txt next to NAME.txt, if one
/// exists.
///
/// Warns, with the line, of TUM timestamps whose size and distance are not plausible as seconds
/// (they are read as ns, us or ms), of poses out of order (they are sorted), of duplicate
/// timestamps (all poses are kept), and of a first pose that would be the identity in the other
/// quaternion order.
///
/// Errors: kBadData with file, line and column for an invalid row, a timestamp beyond 292 years and
/// a covariance that is not positive semi-definite; kInputMissing.
Trajectory ReadTrajectory(const std::filesystem::path& file,
                          TrajectoryFormat format = TrajectoryFormat::kDetect);

/// File of a trajectory to evaluate, and the innovations of its estimator.
struct TrajectoryFile {
  std::filesystem::path file;
  std::string label;                  ///< label in tables: the estimator, or the file's name
  std::filesystem::path innovations;  ///< innovations.csv of the estimator, or empty
};

/// Finds the reference of `path`: the file itself; in a folder truth.tum or groundtruth.tum; in an
/// EuRoC sequence state_groundtruth_estimate0. Errors: kInputMissing if a folder has no reference.
TrajectoryFile ReferenceAt(const std::filesystem::path& path);

/// Finds truth.tum of a run folder, given that folder or the folder of one of its estimators.
/// Errors: kInputMissing if it does not exist; kUsage if `path` is not a folder.
TrajectoryFile TruthOf(const std::filesystem::path& path);

/// Finds the estimates of `path`: the file itself; in a run folder the trajectories of its
/// estimators; in the folder of an estimator its trajectory. Files with covariances are preferred.
/// Errors: kInputMissing if a folder has no trajectory.
std::vector<TrajectoryFile> EstimatesAt(const std::filesystem::path& path);

}  // namespace alidade
