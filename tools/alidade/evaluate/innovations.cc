// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "alidade/base/statistics.h"
#include "alidade/estimation/estimator.h"
#include "alidade/evaluate/evaluate.h"
#include "alidade/io/number_rows.h"

namespace alidade {
namespace {

/// Sums over the accepted measurements of one sensor.
struct SensorSums {
  std::int64_t measurements = 0, inside = 0, products = 0;
  double nis = 0.0;
  /// Sums of a b, a^2 and b^2 over the elements r / s of consecutive measurements a and b.
  double product = 0.0, before2 = 0.0, after2 = 0.0;
  /// r / s of the last measurement of each landmark.
  std::map<std::string, std::vector<double>> last;
};

/// Indices of the used columns of `NAME/innovations.csv`.
struct Columns {
  std::size_t sensor, landmark, outcome, dof, nis, s0, r0;
};

void AddProducts(const std::string& landmark, const std::vector<double>& r, SensorSums& sums) {
  std::vector<double>& last = sums.last[landmark];
  for (std::size_t k = 0; k < last.size() && k < r.size(); ++k) {
    sums.product += last[k] * r[k];
    sums.before2 += last[k] * last[k];
    sums.after2 += r[k] * r[k];
    ++sums.products;
  }
  last = r;
}

void AddRow(const NumberRows& rows, const Columns& columns, std::map<std::int64_t, double>& limits,
            SensorSums& sums) {
  const std::int64_t dof = rows.Index(columns.dof, "dof");
  const double nis = rows.Number(columns.nis, "nis");
  if (dof < 1) rows.FailCell(columns.dof, "dof", "is not a positive number", "1 or more");
  const std::size_t max_dof = rows.size() - std::min(rows.size(), std::max(columns.s0, columns.r0));
  if (static_cast<std::uint64_t>(dof) > max_dof)
    rows.FailLine("the row has too few columns for the value of dof",
                  "dof columns for s and dof columns for r");
  ++sums.measurements;
  sums.nis += nis / static_cast<double>(dof);
  const auto [limit, is_new] = limits.try_emplace(dof, 0.0);
  if (is_new) limit->second = ChiSquareQuantile(0.95, static_cast<int>(dof));
  sums.inside += nis <= limit->second ? 1 : 0;
  std::vector<double> r;
  for (std::size_t k = 0; k < static_cast<std::size_t>(dof); ++k) {
    r.push_back(rows.Number(columns.r0 + k, "r") / rows.Number(columns.s0 + k, "s"));
  }
  AddProducts(std::string(rows.text(columns.landmark)), r, sums);
}

InnovationStatistics Finish(const std::string& sensor, const SensorSums& sums) {
  const auto n = static_cast<double>(sums.measurements);
  InnovationStatistics statistics;
  statistics.sensor = sensor;
  statistics.measurements = sums.measurements;
  statistics.nis_mean = sums.nis / n;
  statistics.nis_within95 = static_cast<double>(sums.inside) / n;
  statistics.autocorrelation = sums.product / std::sqrt(sums.before2 * sums.after2);
  statistics.white_within = 1.96 / std::sqrt(static_cast<double>(sums.products));
  return statistics;
}

}  // namespace

std::vector<InnovationStatistics> ReadInnovations(const std::filesystem::path& file) {
  NumberRows rows(file, {}, {});
  if (!rows.Next()) rows.FailLine("the header line is missing", "innovations.csv of a run folder");
  const std::size_t width = rows.size();
  const auto column = [&rows](const char* name) {
    return rows.ColumnOf(name, "innovations.csv of a run folder");
  };
  const Columns columns{column("sensor"), column("landmark"), column("outcome"), column("dof"),
                        column("nis"),    column("s0"),       column("r0")};
  std::map<std::string, SensorSums> sensors;
  std::map<std::int64_t, double> limits;  // chi2(0.95, dof)
  while (rows.Next()) {
    rows.ExpectColumns(width, "as in the header");
    if (rows.text(columns.outcome) != ToString(Outcome::kAccepted) ||
        rows.text(columns.nis).empty())
      continue;
    AddRow(rows, columns, limits, sensors[std::string(rows.text(columns.sensor))]);
  }
  std::vector<InnovationStatistics> statistics;
  for (const auto& [sensor, sums] : sensors) statistics.push_back(Finish(sensor, sums));
  return statistics;
}

}  // namespace alidade
