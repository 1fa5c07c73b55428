// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/output_folder.h"
#include "alidade/record/columns.h"

namespace alidade::internal {

/// Returns all landmarks of an estimator, sorted by id and generation. A removed landmark has its
/// last estimate. The result is empty if `result` has no map.
std::vector<LandmarkEstimate> AllLandmarks(const EstimatorResult& result);

/// Writes `NAME/landmarks.csv`. The cell of a number that is not finite is empty. Error: kIo.
void WriteLandmarks(const OutputFolder& folder, const std::string& estimator,
                    const std::vector<LandmarkEstimate>& landmarks, RunColumns& run_columns);

}  // namespace alidade::internal
