// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/output_folder.h"
#include "alidade/record/contents.h"

namespace alidade::internal {

/// What a figure of the map has to know.
RecordedMap DescribeMap(const std::vector<LandmarkEstimate>& landmarks);

/// Every landmark that the estimator had, by id and generation: those at the end, and those that
/// were removed before, as they were then. Empty where `result` has no map.
std::vector<LandmarkEstimate> WholeMap(const EstimatorResult& result);

/// `NAME/landmarks.csv`. A number that is not finite is left empty. Error: kIo.
void WriteLandmarks(const OutputFolder& folder, const std::string& estimator,
                    const std::vector<LandmarkEstimate>& landmarks);

}  // namespace alidade::internal
