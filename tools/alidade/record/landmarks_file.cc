// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/landmarks_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/base/csv_file.h"
#include "alidade/base/statistics.h"

namespace alidade::internal {

RecordedMap DescribeMap(const std::vector<LandmarkEstimate>& landmarks,
                        const Eigen::AlignedBox3d& path) {
  RecordedMap map;
  std::array<std::vector<double>, 3> places;
  for (const LandmarkEstimate& one : landmarks) {
    if (!one.position.allFinite()) continue;
    ++map.placed;
    map.known += one.true_position.allFinite() ? 1 : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      places[axis].push_back(one.position[static_cast<Eigen::Index>(axis)]);
    }
  }
  if (map.placed == 0) return map;
  Eigen::Vector3d low, high;  // of 8 in 10: a few lie far off
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::ranges::sort(places[axis]);
    low[static_cast<Eigen::Index>(axis)] = Quantile(places[axis], 0.1);
    high[static_cast<Eigen::Index>(axis)] = Quantile(places[axis], 0.9);
  }
  Eigen::AlignedBox3d box = path;
  box.extend(low).extend(high);
  Eigen::Index thin = 0;
  box.sizes().minCoeff(&thin);
  map.across = thin == 0 ? 1 : 0;
  map.along = thin == 2 ? 1 : 2;
  return map;
}

void WriteLandmarks(const OutputFolder& folder, const std::string& estimator,
                    const std::vector<LandmarkEstimate>& landmarks) {
  CsvFile file(folder, estimator + "/landmarks.csv",
               {"id", "generation", "representation", "x", "y", "z", "sigma_x", "sigma_y",
                "sigma_z", "inverse_distance", "sigma_inverse_distance", "first_s", "last_s",
                "tried", "accepted", "true_x", "true_y", "true_z"});
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
    file.EndRow();
  }
  file.Close();
}

}  // namespace alidade::internal
