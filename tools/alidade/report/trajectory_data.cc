// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/trajectory_data.h"

#include <limits>
#include <nlohmann/json.hpp>

#include "alidade/report/run_tables.h"

namespace alidade::internal {
namespace {

constexpr const char* kPosition = "position";
constexpr const char* kOrientation = "orientation";
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

/// Returns element `index` of each row.
template <std::size_t kSize>
std::vector<double> ElementOf(const std::vector<std::array<double, kSize>>& rows,
                              std::size_t index) {
  std::vector<double> elements;
  for (const auto& row : rows) elements.push_back(row[index]);
  return elements;
}

template <std::size_t kSize>
Json ColumnsOf(const std::vector<std::array<double, kSize>>& rows, ColumnPool& pool) {
  Json columns = Json::array();
  if (rows.empty()) return columns;
  for (std::size_t i = 0; i < kSize; ++i) columns.push_back(pool.AddNumbers(ElementOf(rows, i)));
  return columns;
}

Json BlocksOf(const PageTrajectory& trajectory, ColumnPool& pool) {
  Json blocks = Json::array();
  blocks.push_back({{"name", kPosition},
                    {"unit", "m"},
                    {"geometry", "vector"},
                    {"error_unit", "m"},
                    {"elements", kAxes},
                    {"tangent", kAxes},
                    {"value", ColumnsOf(trajectory.positions, pool)},
                    {"sigma", Json::array()},
                    {"error", ColumnsOf(trajectory.errors, pool)}});
  if (trajectory.orientations.empty()) return blocks;
  blocks.push_back({{"name", kOrientation},
                    {"unit", ""},
                    {"geometry", "unit_quaternion"},
                    {"error_unit", "rad"},
                    {"elements", {"w", "x", "y", "z"}},
                    {"tangent", kAxes},
                    {"value", ColumnsOf(trajectory.orientations, pool)},
                    {"sigma", Json::array()},
                    {"error", Json::array()}});
  return blocks;
}

/// Returns the points as landmarks whose covariances and true positions are unknown.
Json LandmarksOf(const PageTrajectory& trajectory, ColumnPool& pool) {
  const std::vector<std::array<double, 3>>& points = trajectory.points;
  Json data = Json::object();
  data["id"] = pool.AddIds(trajectory.point_ids);
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    data[kAxes[i]] = pool.AddNumbers(ElementOf(points, i));
  }
  const std::vector<double> unknown(points.size(), std::numeric_limits<double>::quiet_NaN());
  const int column = pool.AddNumbers(unknown);
  for (const char* const key : {"sx", "sy", "sz", "cxy", "cxz", "cyz", "tx", "ty", "tz", "tried",
                                "accepted", "first_s", "removed_s"}) {
    data[key] = column;
  }
  return data;
}

Json EstimatorOf(const PageTrajectory& trajectory, const RunTimes& times, ColumnPool& pool) {
  Json data = {{"name", trajectory.name},
               {"sensors", Json::array()},
               {"metrics", Json::object()},
               {"counts", Json::object()},
               {"t", times.ColumnOf(trajectory.timestamps)},
               {"blocks", BlocksOf(trajectory, pool)},
               {"position", kPosition}};
  if (!trajectory.orientations.empty()) data["orientation"] = kOrientation;
  if (!trajectory.points.empty()) data["landmarks"] = LandmarksOf(trajectory, pool);
  for (const char* const key : {"nees", "innovations", "gains", "events"}) {
    data[key] = Json::array();
  }
  return data;
}

}  // namespace

Json TrajectoryData(const std::vector<PageTrajectory>& trajectories,
                    const PageTrajectory* reference, ColumnPool& pool) {
  std::vector<Timestamp> timestamps;
  const auto add = [&](const PageTrajectory& trajectory) {
    timestamps.insert(timestamps.end(), trajectory.timestamps.begin(), trajectory.timestamps.end());
  };
  if (reference != nullptr) add(*reference);
  for (const PageTrajectory& trajectory : trajectories) add(trajectory);
  const RunTimes times(std::move(timestamps), kNoTimestamp, pool);
  Json truth = Json::object(), estimators = Json::array();
  for (std::size_t i = 0; reference != nullptr && i < kAxes.size(); ++i) {
    const std::vector<double> values = ElementOf(reference->positions, i);
    truth[std::string(kPosition) + '.' + kAxes[i]] =
        pool.AddNumbers(times.Align(reference->timestamps, values));
  }
  for (const PageTrajectory& trajectory : trajectories) {
    estimators.push_back(EstimatorOf(trajectory, times, pool));
  }
  return {{"t", times.column()},     {"t0", Seconds(times.origin())}, {"outcomes", Json::array()},
          {"truth", truth},          {"implied", Json::array()},      {"segments", Json::array()},
          {"estimators", estimators}};
}

}  // namespace alidade::internal
