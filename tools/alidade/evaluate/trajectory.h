// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Format of the rows of a pose file. Each pose is world_from_body.
///
///   kTum    t x y z qx qy qz qw                t in s; separated by blanks or commas
///   kTum    t x y z qx qy qz qw Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33
///                                              covariances of rotation, rad^2, in the body frame,
///                                              and of position, m^2, in the world frame
///   kKitti  r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z    no timestamp
///   kEuroc  t,x,y,z,qw,qx,qy,qz[,...]          t in ns, 8, 11 or 17 columns; separated by commas
enum class TrajectoryFormat { kDetect, kTum, kKitti, kEuroc };
/// Returns `detect`, `tum`, `kitti` or `euroc`.
const char* ToString(TrajectoryFormat format);

/// Treatment of a row with a value that is not finite: an error, or the row is left out.
enum class NonFiniteRows { kRefuse, kSkip };

/// Poses of one body in one world, in the order of their timestamps.
struct Trajectory {
  std::string name;  ///< name of the file
  TrajectoryFormat format = TrajectoryFormat::kTum;
  std::vector<Timestamp> timestamps;             ///< ascending; empty if the file has no timestamps
  Eigen::Matrix3Xd positions;                    ///< m, in the world frame
  std::vector<Eigen::Quaterniond> orientations;  ///< world_from_body
  /// Covariances of the position error, in the world frame, m^2, and of the orientation error d,
  /// q_true = q Exp(d), in the body frame, rad^2. Empty if the file has no covariances.
  std::vector<Eigen::Matrix3d> position_covariances, orientation_covariances;
  std::vector<int> rows;              ///< index of the row of each pose; counts left-out rows too
  int row_count = 0;                  ///< number of rows of the file
  int first_line = 0;                 ///< line number of the first pose
  std::vector<std::string> warnings;  ///< warnings about the file, as FILE:LINE: text

  int size() const { return static_cast<int>(orientations.size()); }
  bool has_timestamps() const { return !timestamps.empty(); }
  bool has_covariances() const { return !position_covariances.empty(); }
  /// Returns the length of the path through the poses from `first` to `last`, m.
  double Length(int first, int last) const;
  /// Returns a trajectory of the poses with the given indices.
  Trajectory Select(const std::vector<int>& indices) const;
  /// Returns the trajectory with quaternions in the other order: w first instead of last, or last
  /// instead of first.
  Trajectory WithOtherQuaternionOrder() const;
};

/// Reads a pose file, or standard input if `file` is `-`. kDetect selects the format by the number
/// of columns and by the commas in the first row. Blank lines, lines that begin with `#` and a
/// first row without any number, a header, are skipped. For a KITTI file NAME.txt, timestamps are
/// read from NAME_times.txt or times.txt in the same folder, if one of them exists.
///
/// Adds warnings, which contain the line number:
///
///   - TUM timestamps are not plausible as seconds; they are read as ns, us or ms
///   - poses are out of order; they are sorted
///   - timestamps are duplicate; all poses are retained
///   - the first pose would be the identity in the other quaternion order
///   - quaternions are rounded: their length differs from 1 by more than 1e-3; they are normalised
///   - rows are left out, because a value in them is not finite
///
/// Errors: kInputMissing; kBadData with file, line and column for an invalid row, for a timestamp
/// beyond 292 years, for a quaternion whose length differs from 1 by more than 0.01, and for a
/// covariance that is not positive semi-definite. If the format was detected, the message names it.
Trajectory ReadTrajectory(const std::filesystem::path& file,
                          TrajectoryFormat format = TrajectoryFormat::kDetect,
                          NonFiniteRows non_finite = NonFiniteRows::kRefuse);

/// File of a trajectory to evaluate, and file of the innovations of the same estimator.
struct TrajectoryFile {
  std::filesystem::path file;
  std::string label;                  ///< label in tables: name of the estimator or of the file
  std::filesystem::path innovations;  ///< innovations.csv of the estimator; may be empty
};

/// Finds the reference. `path` is the reference file itself, a folder with truth.tum or
/// groundtruth.tum, or an EuRoC sequence with state_groundtruth_estimate0. Error: kInputMissing if
/// a folder does not contain a reference.
TrajectoryFile ReferenceAt(const std::filesystem::path& path);

/// Finds truth.tum of a run. `path` is the run folder or the folder of an estimator in it. Errors:
/// kInputMissing if truth.tum does not exist; kUsage if `path` is not a folder.
TrajectoryFile TruthOf(const std::filesystem::path& path);

/// Finds the estimated trajectories. `path` is a trajectory file, a run folder with one trajectory
/// for each estimator, or the folder of an estimator. Files with covariances are preferred. Error:
/// kInputMissing if a folder does not contain a trajectory.
std::vector<TrajectoryFile> EstimatesAt(const std::filesystem::path& path);

}  // namespace alidade
