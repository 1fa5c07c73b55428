// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"

namespace alidade::internal {

/// Poses on a page without a run.
struct PageTrajectory {
  std::string name;
  std::vector<Timestamp> timestamps;  ///< sorted
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<double, 4>> orientations;  ///< w x y z; empty: unknown
  std::vector<std::array<double, 3>> errors;        ///< errors of the positions; empty: unknown
  std::vector<std::array<double, 3>> points;        ///< landmarks; empty: none
  std::vector<double> point_ids;                    ///< number of each landmark
};

/// Returns an object like `run` in the data of a page. Its estimators are the trajectories, which
/// have no verdict. The positions of `reference` are the truth; null: there is no truth.
/// `trajectories` contains at least one pose.
Json TrajectoryData(const std::vector<PageTrajectory>& trajectories,
                    const PageTrajectory* reference, ColumnPool& pool);

}  // namespace alidade::internal
