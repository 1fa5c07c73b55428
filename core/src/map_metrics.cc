// SPDX-License-Identifier: Apache-2.0
#include "map_metrics.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace alidade {
namespace {

double RootMeanSquare(const Eigen::Matrix3Xd& errors) {
  return std::sqrt(errors.squaredNorm() / static_cast<double>(errors.cols()));
}

/// Whether the points are not all on one line.
bool SpanAPlane(const Eigen::Matrix3Xd& points) {
  constexpr double kThin = 1e-9;
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Vector3d widths = centred.jacobiSvd().singularValues();
  return widths[1] > kThin * widths[0];
}

}  // namespace

std::map<std::string, double> internal::MapMetrics(const std::vector<LandmarkEstimate>& landmarks) {
  Eigen::Matrix3Xd estimated(3, std::ssize(landmarks)), known = estimated;
  Eigen::Index count = 0;
  for (const LandmarkEstimate& landmark : landmarks) {
    if (!landmark.true_position.allFinite() || !landmark.position.allFinite()) continue;
    estimated.col(count) = landmark.position;
    known.col(count++) = landmark.true_position;
  }
  if (count == 0) return {};
  estimated.conservativeResize(Eigen::NoChange, count);
  known.conservativeResize(Eigen::NoChange, count);
  std::map<std::string, double> metrics = {{"map.rmse", RootMeanSquare(estimated - known)}};
  if (count < 3 || !SpanAPlane(estimated) || !SpanAPlane(known)) return metrics;
  const Eigen::Matrix4d similarity = Eigen::umeyama(estimated, known);
  const Eigen::Matrix3d linear = similarity.topLeftCorner<3, 3>();
  const Eigen::Vector3d shift = similarity.topRightCorner<3, 1>();
  metrics["map.sim3.rmse"] = RootMeanSquare(((linear * estimated).colwise() + shift) - known);
  metrics["map.sim3.scale"] = std::cbrt(linear.determinant());
  return metrics;
}

void internal::NoteMap(const NamedEstimator& named, const Source& source, EstimatorResult& result) {
  if (!named.system.landmarks) return;
  result.landmarks = named.estimator->landmarks();
  for (LandmarkEstimate& landmark : *result.landmarks) {
    const auto position = source.TrueLandmark(landmark.id);
    if (position) landmark.true_position = Eigen::Map<const Eigen::Vector3d>(position->data());
  }
  result.metrics.merge(MapMetrics(*result.landmarks));
}

}  // namespace alidade
