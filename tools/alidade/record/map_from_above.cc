// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/map_from_above.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "alidade/base/statistics.h"

namespace alidade::internal {
namespace {

/// Widens the range, so that it contains the values between the 2 % and 98 % quantiles.
void Widen(std::vector<double> values, double& low, double& high) {
  if (values.empty()) return;
  std::ranges::sort(values);
  low = std::min(low, Quantile(values, 0.02));
  high = std::max(high, Quantile(values, 0.98));
}

}  // namespace

void MapFromAbove::Begin(const Eigen::Vector3d& camera_y) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  constexpr double kFar = std::numeric_limits<double>::infinity();
  int axis = 0;
  camera_y.cwiseAbs().maxCoeff(&axis);
  right_ = axis == 0 ? 1 : 0;
  up_ = axis == 2 ? 1 : 2;
  map_ = {kAxes[right_], kAxes[up_], {}, {}, {}, {}, {}, {kFar, -kFar, kFar, -kFar}};
}

void MapFromAbove::Add(const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance,
                       const Eigen::Matrix3d& world_from_body, const double* true_position,
                       const std::vector<LandmarkEstimate>& landmarks) {
  if (!map_) Begin(world_from_body.col(1));
  map_->position = Of(position, covariance);
  map_->path.push_back(Of(position.data()));
  map_->heading = Of(world_from_body.col(2).data());
  if (true_position != nullptr) map_->true_path.push_back(Of(true_position));
  map_->landmarks.clear();
  for (const LandmarkEstimate& landmark : landmarks) {
    if (!landmark.position.allFinite() || !landmark.covariance.allFinite()) continue;
    map_->landmarks.push_back(Of(landmark.position, landmark.covariance));
  }
  WidenBounds();
}

/// Widens the bounds. The bounds never shrink, so that the picture does not jump between frames.
void MapFromAbove::WidenBounds() {
  std::vector<double> x, y;
  for (const PlaneGaussian& landmark : map_->landmarks) {
    x.push_back(landmark.x);
    y.push_back(landmark.y);
  }
  auto& [left, right, bottom, top] = map_->bounds;
  Widen(std::move(x), left, right);
  Widen(std::move(y), bottom, top);
  for (const auto* path : {&map_->path, &map_->true_path}) {
    if (path->empty()) continue;
    left = std::min(left, path->back()[0]);
    right = std::max(right, path->back()[0]);
    bottom = std::min(bottom, path->back()[1]);
    top = std::max(top, path->back()[1]);
  }
}

}  // namespace alidade::internal
