// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/bundle_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "alidade/base/number_text.h"
#include "alidade/report/conclusion.h"
#include "alidade/report/csv_columns.h"

namespace alidade::internal {
namespace {

using Rows = std::vector<std::uint32_t>;

/// Largest number of residuals on the page, and the number of largest residuals among them.
constexpr std::size_t kMaxResiduals = 60'000, kLargestResiduals = 1000;
constexpr std::size_t kWorst = 20;

/// Residuals of all observations, before or after the adjustment.
class Residuals {
 public:
  /// Reads the columns `prefix.element`.
  Residuals(const CsvColumns& table, const std::string& prefix,
            const std::vector<std::string>& elements) {
    for (const std::string& element : elements) {
      elements_.push_back(table.Numbers(prefix + '.' + element));
    }
    for (std::size_t row = 0; row < table.rows(); ++row) {
      double square = 0.0;
      for (const auto& element : elements_) square += element[row] * element[row];
      norms_.push_back(std::sqrt(square));
    }
  }
  /// Lengths of the residuals; NaN if a residual is undefined.
  const std::vector<double>& norms() const { return norms_; }

  /// Returns the elements of the residual of a row.
  Json Of(std::size_t row) const {
    Json values = Json::array();
    for (const auto& element : elements_) values.push_back(element[row]);
    return values;
  }
  /// Returns a column for each element.
  Json Columns(const Rows& rows, ColumnPool& pool) const {
    Json columns = Json::array();
    for (const auto& element : elements_) columns.push_back(pool.AddSeries(Select(element, rows)));
    return columns;
  }

 private:
  std::vector<std::vector<double>> elements_;
  std::vector<double> norms_;
};

/// Returns the names of the elements of a residual, which the columns `after.NAME` contain.
std::vector<std::string> ElementsOf(const CsvColumns& table) {
  constexpr std::string_view kPrefix = "after.";
  std::vector<std::string> elements;
  for (const std::string_view name : table.names()) {
    if (name.starts_with(kPrefix)) elements.emplace_back(name.substr(kPrefix.size()));
  }
  return elements;
}

/// Observations of an adjustment.
struct Observations {
  explicit Observations(const std::filesystem::path& file)
      : table(file),
        elements(ElementsOf(table)),
        camera(table.Numbers("camera")),
        point(table.Numbers("point")),
        before(table, "before", elements),
        after(table, "after", elements) {
    for (std::uint32_t row = 0; row < table.rows(); ++row) {
      if (std::isfinite(after.norms()[row])) rows.push_back(row);
    }
    by_size = rows;
    std::ranges::stable_sort(by_size, std::greater{},
                             [&](std::uint32_t row) { return after.norms()[row]; });
  }

  CsvColumns table;
  std::vector<std::string> elements;
  std::vector<double> camera, point;
  Residuals before, after;
  Rows rows;     ///< rows with a residual after the adjustment
  Rows by_size;  ///< the same rows, largest residual first
};

double Rms(const std::vector<double>& norms, const Rows& rows) {
  double sum = 0.0, count = 0.0;
  for (const std::uint32_t row : rows) {
    if (!std::isfinite(norms[row])) continue;
    sum += norms[row] * norms[row];
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : std::numeric_limits<double>::quiet_NaN();
}

/// Returns the number, the number of observations and the rms of each camera.
Json CameraData(const std::map<double, Rows>& rows_of_camera, const Observations& observations,
                ColumnPool& pool) {
  std::vector<double> ids, before, after;
  std::vector<std::uint32_t> counts;
  for (const auto& [id, rows] : rows_of_camera) {
    ids.push_back(id);
    counts.push_back(static_cast<std::uint32_t>(rows.size()));
    before.push_back(Rms(observations.before.norms(), rows));
    after.push_back(Rms(observations.after.norms(), rows));
  }
  return {{"id", pool.AddNumbers(ids)},
          {"observations", pool.AddIntegers(counts)},
          {"before", pool.AddNumbers(before)},
          {"after", pool.AddNumbers(after)}};
}

/// Returns the rows whose residuals the page contains, in the order of the file.
Rows ShownRows(const Observations& observations) {
  const Rows& all = observations.by_size;
  if (all.size() <= kMaxResiduals) return observations.rows;
  Rows shown(all.begin(), all.begin() + kLargestResiduals);
  Rows others(all.begin() + kLargestResiduals, all.end());
  std::ranges::sort(others);
  const std::size_t step = 1 + (others.size() - 1) / (kMaxResiduals - kLargestResiduals);
  for (std::size_t i = 0; i < others.size(); i += step) shown.push_back(others[i]);
  std::ranges::sort(shown);
  return shown;
}

/// Returns residuals and the indices of their cameras.
Json ResidualData(const std::map<double, Rows>& rows_of_camera, const Observations& observations,
                  ColumnPool& pool) {
  std::map<double, std::uint32_t> index;
  for (const auto& [id, rows] : rows_of_camera) {
    index.emplace(id, static_cast<std::uint32_t>(index.size()));
  }
  const Rows shown = ShownRows(observations);
  std::vector<std::uint32_t> cameras;
  for (const std::uint32_t row : shown) cameras.push_back(index.at(observations.camera[row]));
  return {{"elements", observations.elements},
          {"total", observations.rows.size()},
          {"camera", pool.AddIntegers(cameras)},
          {"before", observations.before.Columns(shown, pool)},
          {"after", observations.after.Columns(shown, pool)}};
}

Json WorstData(const Observations& observations) {
  Json worst = Json::array();
  for (const std::uint32_t row : observations.by_size) {
    if (worst.size() == kWorst) break;
    worst.push_back({{"camera", observations.camera[row]},
                     {"point", observations.point[row]},
                     {"before", observations.before.Of(row)},
                     {"after", observations.after.Of(row)},
                     {"size", observations.after.norms()[row]}});
  }
  return worst;
}

Json IterationData(const std::filesystem::path& file, ColumnPool& pool) {
  const CsvColumns table(file);
  std::vector<std::uint32_t> accepted;
  for (const double value : table.Numbers("accepted")) accepted.push_back(value > 0.0 ? 1U : 0U);
  return {{"cost", pool.AddNumbers(table.Numbers("cost"))},
          {"accepted", pool.AddIntegers(accepted)}};
}

/// Returns a sentence about the observations far beyond the rms, or nothing.
void AppendOutliers(const Observations& observations, std::vector<Conclusion>& conclusions) {
  constexpr double kFar = 5.0;
  const auto& norms = observations.after.norms();
  const double limit = kFar * Rms(norms, observations.rows);
  const auto far = std::ranges::count_if(observations.rows,
                                         [&](std::uint32_t row) { return norms[row] > limit; });
  if (far == 0) return;
  const std::uint32_t worst = observations.by_size.front();
  conclusions.push_back(
      {Conclusion::Tone::kWarning,
       std::to_string(far) +
           (far == 1 ? " observation has a residual" : " observations have residuals") + " above " +
           RoundedText(kFar) + " times the rms. They may be false matches; see --loss.",
       "largest: " + RoundedText(norms[worst], 4) + " px, camera " +
           RoundedText(observations.camera[worst], 15) + ", point " +
           RoundedText(observations.point[worst], 15)});
}

Json ConclusionsOf(const Json& bundle, const Observations& observations) {
  const bool converged = bundle.at("status") == "converged";
  const double before = bundle.at("rms_before_px"), after = bundle.at("rms_after_px");
  std::vector<Conclusion> conclusions = {
      {converged ? Conclusion::Tone::kGood : Conclusion::Tone::kWarning,
       "The rms reprojection error changed from " + RoundedText(before, 4) + " px to " +
           RoundedText(after, 4) + " px in " + bundle.at("iterations").dump() +
           " iterations. The adjustment has " + (converged ? "" : "not ") + "converged.",
       converged ? "" : bundle.value("message", "")}};
  AppendOutliers(observations, conclusions);
  for (const Json& line : bundle.value("undetermined", Json::array())) {
    conclusions.push_back({Conclusion::Tone::kNeutral, line.get<std::string>() + '.', ""});
  }
  return ConclusionsJson(conclusions);
}

}  // namespace

Json BundleData(const std::filesystem::path& folder, const Json& bundle, ColumnPool& pool) {
  const Observations observations(folder / "observations.csv");
  std::map<double, Rows> rows_of_camera;
  for (const std::uint32_t row : observations.rows) {
    rows_of_camera[observations.camera[row]].push_back(row);
  }
  return {{"results", bundle},
          {"has_times", bundle.at("format") == "tracks"},
          {"conclusions", ConclusionsOf(bundle, observations)},
          {"iterations", IterationData(folder / "iterations.csv", pool)},
          {"cameras", CameraData(rows_of_camera, observations, pool)},
          {"residuals", ResidualData(rows_of_camera, observations, pool)},
          {"worst", WorstData(observations)}};
}

}  // namespace alidade::internal
