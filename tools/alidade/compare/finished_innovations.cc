// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/finished_innovations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "alidade/compare/finished_run.h"
#include "alidade/compare/json_node.h"
#include "alidade/io/number_rows.h"
#include "alidade/io/run_files.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

InnovationSeries DescribedSeries(const std::string& sensor, const internal::JsonNode& entry) {
  InnovationSeries series;
  series.sensor = sensor;
  series.units = entry.At("units").Texts();
  series.has_robust_loss = entry.At("robust_loss").Flag();
  series.has_landmark_prior = entry.At("landmark_prior").Flag();
  for (const internal::JsonNode& index : entry.At("z_index").Items()) {
    const double number = index.Number();
    series.z_index.push_back(
        std::isnan(number) ? -1 : static_cast<int>(index.Count(std::ssize(series.units) - 1)));
  }
  for (const internal::JsonNode& is_angle : entry.At("is_angle").Items()) {
    series.is_angle.push_back(is_angle.Flag() ? 1 : 0);
  }
  series.dof = static_cast<int>(series.z_index.size());
  series.ambient = static_cast<int>(series.units.size());
  return series;
}

std::size_t ColumnOf(const NumberRows& rows, std::string_view name) {
  return rows.ColumnOf(name, "an unmodified run folder; repeat the run");
}

/// Indices of the columns of innovations.csv. z, h, s and r are the indices of their first
/// elements.
struct InnovationColumns {
  explicit InnovationColumns(const NumberRows& rows)
      : count(rows.size()),
        time(ColumnOf(rows, "t_s")),
        sensor(ColumnOf(rows, "sensor")),
        landmark(ColumnOf(rows, "landmark")),
        outcome(ColumnOf(rows, "outcome")),
        nis(ColumnOf(rows, "nis")),
        z(ColumnOf(rows, "z0")),
        h(ColumnOf(rows, "h0")),
        s(ColumnOf(rows, "s0")),
        r(ColumnOf(rows, "r0")) {}

  std::size_t count, time, sensor, landmark, outcome, nis, z, h, s, r;
};

std::vector<double> NumbersOf(const NumberRows& rows, std::size_t first, int count,
                              const char* name) {
  const std::size_t size = static_cast<std::size_t>(count);
  if (first + size > rows.size()) {
    rows.FailLine("the row has too few columns", "an unmodified run folder; repeat the run");
  }
  std::vector<double> numbers;
  for (std::size_t i = first; i < first + size; ++i) numbers.push_back(rows.Number(i, name));
  return numbers;
}

Outcome OutcomeAt(const NumberRows& rows, std::size_t column) {
  const auto info = std::ranges::find(kOutcomes, rows.text(column), &OutcomeInfo::name);
  if (info == kOutcomes.end()) rows.FailCell(column, "outcome", "is unknown", "an outcome");
  return info->outcome;
}

/// Adds a row to the series of its sensor.
void AddRow(const NumberRows& rows, const InnovationColumns& columns, InnovationSeries& series) {
  MeasurementReport report(0, OutcomeAt(rows, columns.outcome), -1, series.dof);
  const Timestamp timestamp = rows.Time(columns.time, "t_s");
  if (!rows.text(columns.landmark).empty()) {
    report.landmark = rows.Index(columns.landmark, "landmark");
  }
  // The numbers of other rows may be infinite or NaN.
  const std::string_view nis = rows.text(columns.nis);
  if (!InnovationSeries::Stores(report.outcome) || nis.empty() || nis == "inf") {
    return series.Add(timestamp, report);
  }
  const auto m = static_cast<std::size_t>(series.dof);
  const std::vector<double> z = NumbersOf(rows, columns.z, series.ambient, "z"),
                            h = NumbersOf(rows, columns.h, series.ambient, "h"),
                            s = NumbersOf(rows, columns.s, series.dof, "s"),
                            r = NumbersOf(rows, columns.r, series.dof, "r");
  std::vector<double> covariance(m * m, 0.0);
  for (std::size_t i = 0; i < m; ++i) covariance[i * (m + 1)] = s[i] * s[i];
  report.nis = rows.Number(columns.nis, "nis");
  report.z = Numbers(z.data(), z.size());
  report.h = Numbers(h.data(), h.size());
  report.s = Numbers(covariance.data(), covariance.size());
  report.innovation = Numbers(r.data(), r.size());
  series.Add(timestamp, report);
}

void ReadSeries(const fs::path& file, std::vector<InnovationSeries>& sensors) {
  internal::RequireFile(file);
  NumberRows rows(file, Place{file.string()}, {});
  if (!rows.Next()) internal::FailFile(file, 0, "the header line is missing");
  const InnovationColumns columns(rows);
  while (rows.Next()) {
    rows.ExpectColumns(columns.count, "as in the header");
    const auto series =
        std::ranges::find(sensors, rows.text(columns.sensor), &InnovationSeries::sensor);
    if (series == sensors.end()) {
      rows.FailCell(columns.sensor, "sensor", "is not in run.json", "an unmodified run folder");
    }
    AddRow(rows, columns, *series);
  }
}

}  // namespace

std::vector<EstimatorInnovations> ReadFinishedInnovations(const fs::path& folder) {
  const internal::Json json = internal::ReadRunJson(folder);
  std::vector<EstimatorInnovations> estimators;
  for (const auto& [name, entry] :
       internal::JsonNode(json, (folder / "run.json").string()).At("estimators").Entries()) {
    EstimatorInnovations& estimator = estimators.emplace_back();
    estimator.estimator = name;
    for (const auto& [sensor, description] : entry.At("innovations").Entries()) {
      estimator.sensors.push_back(DescribedSeries(sensor, description));
    }
    ReadSeries(folder / name / "innovations.csv", estimator.sensors);
  }
  return estimators;
}

}  // namespace alidade
