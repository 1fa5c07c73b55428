// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "alidade/estimation/landmarks.h"
#include "alidade/record/run_view.h"

namespace alidade::internal {

/// Path of a camera and its landmarks, seen from above. The vertical axis of the world is the axis
/// nearest to the y axis of the first pose: a camera looks along z, and y points down.
class MapFromAbove {
 public:
  /// Adds a pose with the covariance of its position. `true_position` may be null.
  void Add(const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance,
           const Eigen::Matrix3d& world_from_body, const double* true_position,
           const std::vector<LandmarkEstimate>& landmarks);
  const std::optional<ViewMap>& map() const { return map_; }

 private:
  std::array<double, 2> Of(const double* point) const { return {point[right_], point[up_]}; }
  PlaneGaussian Of(const Eigen::Vector3d& mean, const Eigen::Matrix3d& p) const {
    return {mean[right_], mean[up_], p(right_, right_), p(right_, up_), p(up_, up_)};
  }
  void Begin(const Eigen::Vector3d& camera_y);
  void WidenBounds();

  int right_ = 0, up_ = 1;  ///< axes of the world
  std::optional<ViewMap> map_;
};

}  // namespace alidade::internal
