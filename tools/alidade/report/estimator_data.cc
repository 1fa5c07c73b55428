// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/estimator_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "alidade/io/number_rows.h"
#include "alidade/report/innovation_data.h"

namespace alidade::internal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool IsKnown(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double value) { return !std::isnan(value); });
}

std::string OwnerOf(const std::string& block) { return block.substr(0, block.find('.')); }

/// Columns of one quantity of a block, from columns.json.
struct BlockColumns {
  std::vector<std::string> names, units;
};

BlockColumns FindColumns(const Json& columns, const std::string& file, const std::string& block,
                         const char* quantity) {
  BlockColumns found;
  if (!columns.contains(file)) return found;
  for (const Json& column : columns.at(file)) {
    if (column.value("subject", "") != block || column.value("quantity", "") != quantity) continue;
    found.names.push_back(column.at("name").get<std::string>());
    found.units.push_back(column.value("unit", ""));
  }
  return found;
}

/// Returns the names of elements without the name of their block and without the quantity.
Json ElementNames(const BlockColumns& columns, const std::string& block) {
  Json names = Json::array();
  for (const std::string& name : columns.names) {
    const std::size_t start = name.find(block) + block.size();
    names.push_back(start < name.size() ? name.substr(start + 1) : "");
  }
  return names;
}

/// Adds the columns that have a value.
Json AddColumns(const CsvColumns& table, const BlockColumns& columns, ColumnPool& pool) {
  Json list = Json::array();
  for (const std::string& name : columns.names) {
    const std::vector<double> numbers = table.Numbers(name);
    if (IsKnown(numbers)) list.push_back(pool.AddSeries(numbers));
  }
  return list;
}

Json BlockData(const EstimatorTables& tables, const Json& block, const Json& columns,
               ColumnPool& pool) {
  const std::string name = block.at("name").get<std::string>();
  const std::string estimates = tables.name + "/estimates.csv";
  const BlockColumns values = FindColumns(columns, estimates, name, "value");
  const BlockColumns sigmas = FindColumns(columns, estimates, name, "sigma");
  const BlockColumns errors = FindColumns(columns, tables.name + "/errors.csv", name, "error");
  Json value = Json::array();
  for (const std::string& column : values.names) {
    value.push_back(pool.AddNumbers(tables.estimates.Numbers(column)));
  }
  const bool has_errors = tables.errors.rows() == tables.estimates.rows();
  return {{"name", name},
          {"unit", block.at("unit")},
          {"geometry", block.at("geometry")},
          {"error_unit", sigmas.units.empty() ? "" : sigmas.units.front()},
          {"elements", ElementNames(values, name)},
          {"tangent", ElementNames(sigmas, name)},
          {"value", value},
          {"sigma", AddColumns(tables.estimates, sigmas, pool)},
          {"error", has_errors ? AddColumns(tables.errors, errors, pool) : Json::array()}};
}

/// Returns the NEES of each owner over time. NEES is divided by the degrees of freedom.
Json NeesData(const EstimatorTables& tables, ColumnPool& pool) {
  const std::string_view prefix = "nees:";
  Json list = Json::array();
  if (tables.errors.rows() != tables.estimates.rows()) return list;
  for (const std::string_view name : tables.errors.names()) {
    if (!name.starts_with(prefix)) continue;
    const std::string owner(name.substr(prefix.size()));
    const Json& metrics = tables.entry.at("metrics");
    const std::vector<double> nees = tables.errors.Numbers(name);
    const auto dof = metrics.find("nees.dof:" + owner);
    if (!IsKnown(nees) || dof == metrics.end() || !dof->is_number()) continue;
    list.push_back({{"owner", owner},
                    {"dof", std::max(1L, std::lround(dof->get<double>()))},
                    {"v", pool.AddNumbers(nees)}});
  }
  return list;
}

/// Returns the covariance of the final state: the names of the elements, and the lower triangle.
Json FinalCovarianceData(const CsvColumns& table, ColumnPool& pool) {
  Json labels = Json::array();
  std::vector<double> lower;
  const std::vector<std::string_view> names = table.Texts("element");
  std::vector<std::vector<double>> columns;
  for (const std::string_view name : names) {
    labels.push_back(std::string(name));
    columns.push_back(table.Numbers(name));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) lower.push_back(columns[j][i]);
  }
  return {{"labels", labels}, {"lower", pool.AddNumbers(lower)}};
}

/// Returns the name of the block with the position, or "". The entry of the estimator may name it;
/// otherwise it is the first vector `*position` with 2 or 3 elements.
std::string PositionBlock(const Json& entry) {
  if (entry.contains("position_block")) return entry.at("position_block").get<std::string>();
  for (const Json& block : entry.at("blocks")) {
    const std::string name = block.at("name").get<std::string>();
    const int size = block.at("size").get<int>();
    const bool is_vector = block.at("geometry") == "vector" && (size == 2 || size == 3);
    if (is_vector && name.ends_with("position")) return name;
  }
  return "";
}

/// Returns the name of the quaternion with the owner of `position`, or "".
std::string OrientationBlock(const Json& entry, const std::string& position) {
  for (const Json& block : entry.at("blocks")) {
    const std::string name = block.at("name").get<std::string>();
    const bool is_rotation = block.at("geometry") == "unit_quaternion";
    if (is_rotation && OwnerOf(name) == OwnerOf(position)) return name;
  }
  return "";
}

/// Returns the columns P_xy, P_xz, P_yz of the position, from trajectory_covariance.tum; empty if
/// the file is missing.
Json PositionCovariance(const EstimatorTables& tables, ColumnPool& pool) {
  constexpr std::array<std::size_t, 3> kColumns = {15, 16, 18};  // Pt12, Pt13, Pt23
  Json list = Json::array();
  if (!std::filesystem::exists(tables.covariance_file)) return list;
  const std::vector<Timestamp> times = tables.estimates.Times();
  std::array<std::vector<double>, 3> covariances;
  covariances.fill(std::vector<double>(times.size(), kNan));
  NumberRows rows(tables.covariance_file, Place{tables.covariance_file.string()}, {}, ' ');
  while (rows.Next()) {
    rows.ExpectColumns(20, "as in the comment at the start of the file");
    const Timestamp time = rows.Time(0, "t");
    const auto found = std::ranges::lower_bound(times, time);
    if (found == times.end() || *found != time) continue;
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      covariances[i][static_cast<std::size_t>(found - times.begin())] =
          rows.Number(kColumns[i], "Pt");
    }
  }
  for (const std::vector<double>& column : covariances) list.push_back(pool.AddNumbers(column));
  return list;
}

Json LandmarkData(const CsvColumns& table, const RunTimes& times, ColumnPool& pool) {
  constexpr std::array<std::pair<const char*, const char*>, 14> kColumns = {
      {{"x", "x"},
       {"y", "y"},
       {"z", "z"},
       {"sx", "sigma_x"},
       {"sy", "sigma_y"},
       {"sz", "sigma_z"},
       {"cxy", "cov_xy"},
       {"cxz", "cov_xz"},
       {"cyz", "cov_yz"},
       {"tx", "true_x"},
       {"ty", "true_y"},
       {"tz", "true_z"},
       {"tried", "tried"},
       {"accepted", "accepted"}}};
  std::vector<std::uint32_t> rows;  // landmarks with a position
  const std::vector<double> x = table.Numbers("x");
  for (std::uint32_t row = 0; row < x.size(); ++row) {
    if (std::isfinite(x[row])) rows.push_back(row);
  }
  if (rows.empty()) return {};
  Json data;
  data["id"] = pool.AddIds(Select(table.Numbers("id"), rows));
  for (const auto& [key, column] : kColumns) {
    data[key] = pool.AddNumbers(Select(table.Numbers(column), rows));
  }
  for (const char* key : {"first_s", "removed_s"}) {
    std::vector<double> seconds;
    for (const Timestamp time : Select(table.Times(key), rows)) {
      seconds.push_back(times.SecondsOf(time));
    }
    data[key] = pool.AddNumbers(seconds);
  }
  return data;
}

Json EventData(const CsvColumns& table, const RunTimes& times) {
  Json list = Json::array();
  const auto kinds = table.Texts("kind"), texts = table.Texts("text");
  const std::vector<Timestamp> timestamps = table.Times();
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const bool is_timed = timestamps[i] != kNoTimestamp;
    list.push_back({is_timed ? Json(times.SecondsOf(timestamps[i])) : Json(), std::string(kinds[i]),
                    std::string(texts[i])});
  }
  return list;
}

/// Adds the blocks with the pose, for the map.
void AddPose(const EstimatorTables& tables, Json& data, ColumnPool& pool) {
  const std::string position = PositionBlock(tables.entry);
  if (position.empty()) return;
  data["position"] = position;
  const std::string orientation = OrientationBlock(tables.entry, position);
  if (!orientation.empty()) data["orientation"] = orientation;
  const Json covariance = PositionCovariance(tables, pool);
  if (!covariance.empty()) data["position_cov"] = covariance;
}

}  // namespace

Json EstimatorData(const EstimatorTables& tables, const Json& columns, const Json& gate,
                   bool has_measurements, const RunTimes& times, ColumnPool& pool) {
  Json data = {{"name", tables.name}};
  for (const char* key : {"type", "kind", "smoothed", "failed", "sensors", "metrics", "counts",
                          "verdict", "diagnosis", "unobservable", "overrides"}) {
    if (tables.entry.contains(key)) data[key] = tables.entry.at(key);
  }
  if (!tables.counts.empty()) data["counts"] = tables.counts;
  data["gate"] = gate;
  data["t"] = times.ColumnOf(tables.estimates.Times());
  Json& blocks = data["blocks"] = Json::array();
  for (const Json& block : tables.entry.at("blocks")) {
    blocks.push_back(BlockData(tables, block, columns, pool));
  }
  data["nees"] = NeesData(tables, pool);
  if (tables.final_covariance.rows() > 0) {
    data["last_p"] = FinalCovarianceData(tables.final_covariance, pool);
  }
  AddPose(tables, data, pool);
  data["innovations"] = InnovationData(tables, has_measurements, times, pool);
  data["gains"] = GainData(tables, times, pool);
  const Json landmarks = LandmarkData(tables.landmarks, times, pool);
  if (!landmarks.is_null()) data["landmarks"] = landmarks;
  data["events"] = EventData(tables.events, times);
  return data;
}

}  // namespace alidade::internal
