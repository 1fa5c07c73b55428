// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "alidade/diagnosis/innovation_series.h"

namespace alidade {

/// Innovations of the sensors of one estimator.
struct EstimatorInnovations {
  std::string estimator;
  std::vector<InnovationSeries> sensors;
};

/// Reads the innovations of each estimator of a finished run: NAME/innovations.csv, and their
/// descriptions in run.json. Off-diagonal elements of S are not recorded. Errors: kInputMissing,
/// kBadData.
std::vector<EstimatorInnovations> ReadFinishedInnovations(const std::filesystem::path& folder);

}  // namespace alidade
