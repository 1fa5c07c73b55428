// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/innovation_data.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "alidade/estimation/estimator.h"

namespace alidade::internal {
namespace {

/// Rows of one sensor in innovations.csv.
struct SensorRows {
  const CsvColumns& table;
  std::vector<std::uint32_t> rows;

  std::vector<double> Numbers(const std::string& name) const {
    return Select(table.Numbers(name), rows);
  }
  std::vector<double> Numbers(const char* letter, std::size_t index) const {
    return Numbers(letter + std::to_string(index));
  }
};

std::vector<std::uint32_t> OutcomeCodes(const SensorRows& sensor) {
  std::vector<std::uint32_t> codes;
  for (const std::string_view name : Select(sensor.table.Texts("outcome"), sensor.rows)) {
    const auto info = std::ranges::find(kOutcomes, name, &OutcomeInfo::name);
    codes.push_back(static_cast<std::uint32_t>(info - kOutcomes.begin()));
  }
  return codes;
}

/// Returns the ids of the landmarks. Returns an empty list if no measurement has an id.
std::vector<double> LandmarkIds(const SensorRows& sensor) {
  std::vector<double> ids = sensor.Numbers("landmark");
  const bool has_id = std::ranges::any_of(ids, [](double id) { return std::isfinite(id); });
  return has_id ? ids : std::vector<double>{};
}

/// Adds the elements `letter`0 to `letter`(size - 1) of each row.
Json Elements(const SensorRows& sensor, const char* letter, std::size_t size, ColumnPool& pool) {
  Json list = Json::array();
  for (std::size_t i = 0; i < size; ++i) list.push_back(pool.AddSeries(sensor.Numbers(letter, i)));
  return list;
}

/// Adds the normalised innovations r / s, and the first two elements of r, as clouds.
void AddClouds(const SensorRows& sensor, std::size_t dof, Json& data, ColumnPool& pool) {
  constexpr double kResolution = 0.001;  // of a normalised innovation
  Json normalised = Json::array(), innovations = Json::array();
  for (std::size_t i = 0; i < dof; ++i) {
    const std::vector<double> r = sensor.Numbers("r", i);
    std::vector<double> ratios = r;
    const std::vector<double> s = sensor.Numbers("s", i);
    for (std::size_t row = 0; row < ratios.size(); ++row) ratios[row] /= s[row];
    normalised.push_back(pool.AddCloud(ratios, kResolution));
    if (i < 2) innovations.push_back(pool.AddCloud(r));
  }
  data["nu"] = normalised;
  data["r"] = innovations;
}

/// Returns the common unit of the elements of a measurement, or "".
std::string CommonUnit(const Json& description) {
  const Json& units = description.at("units");
  const bool is_common = !units.empty() && std::ranges::all_of(units, [&](const Json& unit) {
    return unit == units.front();
  });
  return is_common ? units.front().get<std::string>() : "";
}

Json SensorData(const std::string& name, const Json& description, const SensorRows& sensor,
                bool has_measurements, const RunTimes& times, ColumnPool& pool) {
  constexpr std::size_t kMaxExactRows = 500;  // of a sensor of landmarks
  const std::size_t dof = description.at("z_index").size();
  const std::size_t ambient = description.at("units").size();
  Json data = {{"sensor", name},
               {"stream", std::string(sensor.table.Texts("stream")[sensor.rows.front()])},
               {"dof", dof},
               {"unit", CommonUnit(description)},
               {"t", times.ColumnOf(Select(sensor.table.Times(), sensor.rows))},
               {"outcome", pool.AddIntegers(OutcomeCodes(sensor))},
               {"nis", pool.AddSeries(sensor.Numbers("nis"))}};
  const std::vector<double> ids = LandmarkIds(sensor);
  if (!ids.empty()) data["landmark"] = pool.AddIds(ids);
  if (!ids.empty() && sensor.rows.size() > kMaxExactRows) {
    AddClouds(sensor, dof, data, pool);
    return data;
  }
  data["r"] = Elements(sensor, "r", dof, pool);
  data["s"] = Elements(sensor, "s", dof, pool);
  if (has_measurements && ids.empty() && dof <= 3) {
    data["z"] = Elements(sensor, "z", ambient, pool);
    data["h"] = Elements(sensor, "h", ambient, pool);
  }
  return data;
}

}  // namespace

Json InnovationData(const EstimatorTables& tables, bool has_measurements, const RunTimes& times,
                    ColumnPool& pool) {
  Json list = Json::array();
  if (!tables.entry.contains("innovations")) return list;
  for (const auto& [name, description] : tables.entry.at("innovations").items()) {
    const SensorRows sensor{tables.innovations, RowsWith(tables.innovations, "sensor", name)};
    if (sensor.rows.empty()) continue;
    list.push_back(SensorData(name, description, sensor, has_measurements, times, pool));
  }
  return list;
}

Json GainData(const EstimatorTables& tables, const RunTimes& times, ColumnPool& pool) {
  constexpr std::size_t kMaxGains = 24;  // more would not be readable
  Json list = Json::array();
  for (const std::string& sensor : DistinctTexts(tables.gains, "sensor")) {
    const std::vector<std::uint32_t> rows = RowsWith(tables.gains, "sensor", sensor);
    Json columns = Json::array();
    for (const std::string_view name : tables.gains.names()) {
      if (name.find("<-") == name.npos) continue;
      const std::vector<double> gains = Select(tables.gains.Numbers(name), rows);
      if (std::ranges::none_of(gains, [](double gain) { return std::isfinite(gain); })) continue;
      columns.push_back({{"name", std::string(name)}, {"v", pool.AddNumbers(gains)}});
      if (columns.size() > kMaxGains) break;
    }
    if (columns.empty() || columns.size() > kMaxGains) continue;
    list.push_back({{"sensor", sensor},
                    {"t", times.ColumnOf(Select(tables.gains.Times(), rows))},
                    {"columns", columns}});
  }
  return list;
}

}  // namespace alidade::internal
