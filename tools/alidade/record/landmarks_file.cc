// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/landmarks_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "alidade/io/csv_file.h"

namespace alidade::internal {

RecordedMap DescribeMap(const std::vector<LandmarkEstimate>& landmarks) {
  RecordedMap map;
  for (const LandmarkEstimate& landmark : landmarks) {
    if (!landmark.position.allFinite()) continue;
    ++map.placed;
    map.known += landmark.true_position.allFinite() ? 1 : 0;
    map.removed += landmark.removed != kNoTimestamp ? 1 : 0;
  }
  return map;
}

std::vector<LandmarkEstimate> AllLandmarks(const EstimatorResult& result) {
  if (!result.landmarks) return {};
  std::vector<LandmarkEstimate> map = *result.landmarks;
  map.insert(map.end(), result.removed_landmarks.begin(), result.removed_landmarks.end());
  std::ranges::sort(map, {}, [](const LandmarkEstimate& landmark) {
    return std::pair(landmark.id, landmark.generation);
  });
  return map;
}

void WriteLandmarks(const OutputFolder& folder, const std::string& estimator,
                    const std::vector<LandmarkEstimate>& landmarks) {
  CsvFile file(folder, estimator + "/landmarks.csv",
               {"id",
                "generation",
                "representation",
                "x",
                "y",
                "z",
                "sigma_x",
                "sigma_y",
                "sigma_z",
                "inverse_distance",
                "sigma_inverse_distance",
                "first_s",
                "last_s",
                "tried",
                "accepted",
                "true_x",
                "true_y",
                "true_z",
                "cov_xy",
                "cov_xz",
                "cov_yz",
                "status",
                "removed_s"});
  const auto number = [&file](double value) {
    if (std::isfinite(value)) {
      file.Number(value);
    } else {
      file.Empty();
    }
  };
  for (const LandmarkEstimate& landmark : landmarks) {
    file.Integer(landmark.id)
        .Integer(landmark.generation)
        .Text(landmark.representation ? ToString(*landmark.representation) : "");
    for (const double x : landmark.position) number(x);
    for (int i = 0; i < 3; ++i) number(std::sqrt(landmark.covariance(i, i)));
    number(landmark.inverse_distance);
    number(landmark.sigma);
    file.Time(landmark.first)
        .Time(landmark.last)
        .Integer(landmark.tried)
        .Integer(landmark.accepted);
    for (const double x : landmark.true_position) number(x);
    number(landmark.covariance(0, 1));
    number(landmark.covariance(0, 2));
    number(landmark.covariance(1, 2));
    file.Text(landmark.removed == kNoTimestamp ? "kept" : "removed")
        .Time(landmark.removed)
        .EndRow();
  }
  file.Close();
}

}  // namespace alidade::internal
