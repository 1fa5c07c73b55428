// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/bundle_data.h"

#include <nlohmann/json.hpp>

#include "alidade/io/number_rows.h"
#include "alidade/report/csv_columns.h"
#include "alidade/report/trajectory_data.h"

namespace alidade::internal {

Json BundleScene(const std::filesystem::path& folder, ColumnPool& pool) {
  PageTrajectory cameras{"cameras", {}, {}, {}, {}, {}};
  const std::filesystem::path poses = folder / "poses.tum";
  NumberRows rows(poses, Place{poses.string()}, {}, ' ');
  while (rows.Next()) {
    rows.ExpectColumns(8, "t x y z qx qy qz qw");
    const auto [x, y, z, qx, qy, qz, qw] = PoseNumbers(rows, kTumPose);
    cameras.timestamps.push_back(rows.Time(0, "t"));
    cameras.positions.push_back({x, y, z});
    cameras.orientations.push_back({qw, qx, qy, qz});
  }
  if (cameras.timestamps.empty()) return {};
  const CsvColumns points(folder / "points.csv");
  const std::vector<double> x = points.Numbers("x"), y = points.Numbers("y"),
                            z = points.Numbers("z");
  for (std::size_t i = 0; i < x.size(); ++i) cameras.points.push_back({x[i], y[i], z[i]});
  return TrajectoryData({cameras}, nullptr, pool);
}

}  // namespace alidade::internal
