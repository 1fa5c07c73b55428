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

/// Indices of a position and of the orientation that belongs to it: three numbers and a quaternion,
/// or of a planar pose two numbers and an angle about z.
struct PosePlace {
  std::size_t position, orientation;
  bool planar = false;
};
/// The first value X.position that has an X.orientation: of 3 and 4 numbers, or planar of 2 and 1,
/// where the angle may be called heading, yaw, angle or theta too. A name may do without X. None if
/// there is no such pair.
std::optional<PosePlace> FindPose(const std::vector<StreamInfo>& values);

/// A file of poses as of TUM, `t x y z qx qy qz qw`, with covariances or without. A planar pose has
/// z = 0, turns about z, and is exactly known in the other axes.
class PoseFile {
 public:
  /// Creates the file with a line of comment that names the columns. Errors: kCannotCreate, kIo.
  PoseFile(const OutputFolder& folder, const std::string& name, const PosePlace& place,
           bool with_covariances = false);

  /// The orientation is w x y z, or the angle, rad. Error: kIo.
  void Add(Timestamp timestamp, const double* position, const double* orientation);
  /// With covariances in the tangent, m^2 in the world and rad^2 in the body; one that is not
  /// finite is written as zeros.
  void Add(Timestamp timestamp, const double* position, const double* orientation,
           const Eigen::MatrixXd& position_covariance,
           const Eigen::MatrixXd& orientation_covariance);
  /// The pose among the truths of a frame; no row where it is not known.
  void AddTruth(const SourceFrame& frame);
  void Close();

 private:
  void AppendPose(std::string& row, Timestamp timestamp, const double* position,
                  const double* orientation) const;

  PosePlace place_;
  std::unique_ptr<OutputFile> file_;
};

}  // namespace alidade::internal
