// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/bundle_scene.h"

#include <nlohmann/json.hpp>

#include "alidade/io/number_rows.h"
#include "alidade/report/csv_columns.h"
#include "alidade/report/trajectory_data.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

void AppendPoses(const fs::path& file, PageTrajectory& cameras) {
  NumberRows rows(file, Place{file.string()}, {}, ' ');
  while (rows.Next()) {
    rows.ExpectColumns(8, "t x y z qx qy qz qw");
    const auto [x, y, z, qx, qy, qz, qw] = PoseNumbers(rows, kTumPose);
    cameras.timestamps.push_back(rows.Time(0, "t"));
    cameras.positions.push_back({x, y, z});
    cameras.orientations.push_back({qw, qx, qy, qz});
  }
}

void AppendPoints(const fs::path& file, PageTrajectory& cameras) {
  const CsvColumns points(file);
  const std::vector<double> id = points.Numbers("point"), x = points.Numbers("x"),
                            y = points.Numbers("y"), z = points.Numbers("z");
  const std::size_t step = 1 + (x.size() - (x.empty() ? 0 : 1)) / kScenePoints;
  for (std::size_t i = 0; i < x.size(); i += step) {
    cameras.points.push_back({x[i], y[i], z[i]});
    cameras.point_ids.push_back(id[i]);
  }
}

}  // namespace

Json BundleScene(const fs::path& folder, ColumnPool& pool) {
  PageTrajectory before = {"before", {}, {}, {}, {}, {}, {}}, after = before;
  after.name = "after";
  AppendPoses(folder / "poses_before.tum", before);
  AppendPoses(folder / "poses.tum", after);
  if (before.timestamps.empty() || after.timestamps.empty()) return {};
  AppendPoints(folder / "points_before.csv", before);
  AppendPoints(folder / "points.csv", after);
  return TrajectoryData({before, after}, nullptr, pool);
}

}  // namespace alidade::internal
