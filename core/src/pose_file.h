// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alidade/source.h"
#include "run_folder.h"

namespace alidade::internal {

/// Indices of a position and of the orientation that belongs to it.
struct PosePlace {
  std::size_t position, orientation;
};
/// The first value X.position, of 3 numbers, with an X.orientation, of 4; none where there is no
/// such pair.
std::optional<PosePlace> FindPose(const std::vector<StreamInfo>& values);

/// A file of poses as of TUM, `t x y z qx qy qz qw`, with covariances or without.
class PoseFile {
 public:
  /// Creates the file with a line of comment that names the columns. Errors: kCannotCreate, kIo.
  PoseFile(const RunFolder& folder, const std::string& name, bool with_covariances = false);

  /// The orientation is w x y z. Error: kIo.
  void Add(Stamp stamp, const double* position, const double* orientation);
  /// With covariances in the tangent, m^2 in the world and rad^2 in the body; one that is not
  /// finite is written as zeros.
  void Add(Stamp stamp, const double* position, const double* orientation,
           const Eigen::Matrix3d& position_covariance,
           const Eigen::Matrix3d& orientation_covariance);
  /// The pose among the truths of a frame; no row where it is not known.
  void AddTruth(const Frame& frame, const PosePlace& place);
  void Close();

 private:
  std::unique_ptr<OutputFile> file_;
};

}  // namespace alidade::internal
