// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "alidade/base/output_folder.h"
#include "alidade/filter/estimator.h"
#include "alidade/record/contents.h"

namespace alidade::internal {

/// What a figure of the map has to know.
RecordedMap DescribeMap(const std::vector<LandmarkEstimate>& landmarks,
                        const Eigen::AlignedBox3d& path);

/// `NAME/landmarks.csv`: the map at the end. A number that is not finite is left empty. Error: kIo.
void WriteLandmarks(const OutputFolder& folder, const std::string& estimator,
                    const std::vector<LandmarkEstimate>& landmarks);

}  // namespace alidade::internal
