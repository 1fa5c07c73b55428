// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/landmarks_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "alidade/io/csv_file.h"

namespace alidade::internal {

RecordedMap DescribeMap(const std::vector<LandmarkEstimate>& landmarks) {
  RecordedMap map;
  for (const LandmarkEstimate& one : landmarks) {
    if (!one.position.allFinite()) continue;
    ++map.placed;
    map.known += one.true_position.allFinite() ? 1 : 0;
    map.removed += one.removed != kNoTimestamp ? 1 : 0;
  }
  return map;
}

std::vector<LandmarkEstimate> WholeMap(const EstimatorResult& result) {
  if (!result.landmarks) return {};
  std::vector<LandmarkEstimate> map = *result.landmarks;
  map.insert(map.end(), result.removed_landmarks.begin(), result.removed_landmarks.end());
  std::ranges::sort(map, {},
                    [](const LandmarkEstimate& one) { return std::pair(one.id, one.generation); });
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
  for (const LandmarkEstimate& one : landmarks) {
    file.Integer(one.id)
        .Integer(one.generation)
        .Text(one.representation ? ToString(*one.representation) : "");
    for (const double x : one.position) number(x);
    for (int i = 0; i < 3; ++i) number(std::sqrt(one.covariance(i, i)));
    number(one.inverse_distance);
    number(one.sigma);
    file.Time(one.first).Time(one.last).Integer(one.tried).Integer(one.accepted);
    for (const double x : one.true_position) number(x);
    number(one.covariance(0, 1));
    number(one.covariance(0, 2));
    number(one.covariance(1, 2));
    file.Text(one.removed == kNoTimestamp ? "kept" : "removed").Time(one.removed).EndRow();
  }
  file.Close();
}

}  // namespace alidade::internal
