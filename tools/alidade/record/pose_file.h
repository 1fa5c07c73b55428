// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/source.h"
#include "alidade/io/output_folder.h"

namespace alidade::internal {

/// Indices of the position and of the orientation of a pose in a list of values. The position has
/// three numbers, and the orientation is a quaternion. In a planar pose, the position has two
/// numbers, and the orientation is an angle about z.
struct PosePlace {
  std::size_t position, orientation;
  bool planar = false;
};
/// Finds the first value X.position for which X.orientation exists. The sizes must be 3 and 4, or 2
/// and 1 for a planar pose. The name of a planar angle may also be heading, yaw, angle or theta.
/// The prefix X. is optional. Returns nullopt if there is no such pair.
std::optional<PosePlace> FindPose(const std::vector<StreamInfo>& values);

/// Writer of a pose file in TUM format, `t x y z qx qy qz qw`, with or without covariances. A
/// planar pose is written with z = 0, a rotation about z, and zero variances for the other axes.
class PoseFile {
 public:
  /// Creates the file and writes a comment line with the names of the columns. Errors:
  /// kCannotCreate, kIo.
  PoseFile(const OutputFolder& folder, const std::string& name, const PosePlace& place,
           bool with_covariances = false);

  /// Writes a pose. The orientation is the quaternion w x y z or the planar angle in rad. Error:
  /// kIo.
  void Add(Timestamp timestamp, const double* position, const double* orientation);
  /// Writes a pose with covariances. The covariance of the position is in the world frame, m^2. The
  /// covariance of the orientation is in the body frame, rad^2. A covariance that is not finite is
  /// written as zeros.
  void Add(Timestamp timestamp, const double* position, const double* orientation,
           const Eigen::MatrixXd& position_covariance,
           const Eigen::MatrixXd& orientation_covariance);
  /// Writes the true pose of a frame, if the pose is known.
  void AddTruth(const SourceFrame& frame);
  void Close();

 private:
  void AppendPose(std::string& row, Timestamp timestamp, const double* position,
                  const double* orientation) const;

  PosePlace place_;
  std::unique_ptr<OutputFile> file_;
};

}  // namespace alidade::internal
