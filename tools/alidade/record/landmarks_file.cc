// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/landmarks_file.h"

#include <algorithm>
#include <utility>

#include "alidade/record/column_tables.h"

namespace alidade::internal {

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
                    const std::vector<LandmarkEstimate>& landmarks, RunColumns& run_columns) {
  std::vector<Column> columns;
  AppendColumns(kLandmarkColumns, NoLayout{}, columns);
  CsvFile file = CreateCsv(folder, estimator + "/landmarks.csv", std::move(columns), run_columns);
  for (const LandmarkEstimate& landmark : landmarks) {
    WriteCells(kLandmarkColumns, NoLayout{}, landmark, file);
    file.EndRow();
  }
  file.Close();
}

}  // namespace alidade::internal
