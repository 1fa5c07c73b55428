// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/map_metrics.h"

#include <cmath>

#include "alidade/experiment/similarity.h"

namespace alidade {
namespace {

double RootMeanSquare(const Eigen::Matrix3Xd& errors) {
  return std::sqrt(errors.squaredNorm() / static_cast<double>(errors.cols()));
}

}  // namespace

std::map<std::string, double> internal::MapMetrics(const std::vector<LandmarkEstimate>& landmarks) {
  Eigen::Matrix3Xd estimated(3, std::ssize(landmarks)), truth = estimated;
  Eigen::Index count = 0;
  for (const LandmarkEstimate& landmark : landmarks) {
    if (!landmark.true_position.allFinite() || !landmark.position.allFinite()) continue;
    estimated.col(count) = landmark.position;
    truth.col(count++) = landmark.true_position;
  }
  if (count == 0) return {};
  estimated.conservativeResize(Eigen::NoChange, count);
  truth.conservativeResize(Eigen::NoChange, count);
  std::map<std::string, double> metrics = {{"map.rmse", RootMeanSquare(estimated - truth)}};
  if (const auto aligned = internal::AlignBySimilarity(estimated, truth)) {
    metrics["map.sim3.rmse"] = aligned->rmse;
    metrics["map.sim3.scale"] = aligned->scale;
  }
  return metrics;
}

void internal::AddMapMetrics(const EstimatorSpec& spec, const Source& source,
                             EstimatorResult& result) {
  if (!spec.problem.landmarks) return;
  result.landmarks = spec.estimator->landmarks();
  for (std::vector<LandmarkEstimate>* map : {&*result.landmarks, &result.removed_landmarks}) {
    for (LandmarkEstimate& landmark : *map) {
      const auto position = source.TrueLandmark(landmark.id);
      if (position) landmark.true_position = Eigen::Map<const Eigen::Vector3d>(position->data());
    }
  }
  result.metrics.merge(MapMetrics(*result.landmarks));
}

}  // namespace alidade
