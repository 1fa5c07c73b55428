// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metric_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/experiment.h"
#include "alidade/io/text_table.h"

namespace alidade {
namespace internal {
namespace {

constexpr std::array<std::string_view, 12> kOrder = {
    "rmse",          "implied.rmse",   "lag_ms",       "coverage95",
    "nees.mean",     "nees.within95",  "nis.mean",     "map.rmse",
    "map.sim3.rmse", "map.sim3.scale", "reprojection", "settling_frames"};

std::string_view KindOf(std::string_view key) { return key.substr(0, key.find(':')); }

/// `target.depth` of `rmse:target.depth@blind`.
std::string_view SubjectOf(std::string_view key) {
  const std::string_view rest = key.substr(std::min(key.find(':'), key.size() - 1) + 1);
  return rest.substr(0, rest.find('@'));
}

/// Sorts by kind, whole before segments, then by name.
auto Rank(const std::string& key) {
  const auto kind = std::find(kOrder.begin(), kOrder.end(), KindOf(key)) - kOrder.begin();
  const std::size_t segment = key.find('@');
  return std::tuple(kind, segment == key.npos ? "" : key.substr(segment), key);
}

template <class Map>
std::vector<std::string> Keys(const RunResult& result, const Map EstimatorResult::*values) {
  std::vector<std::string> keys;
  for (const EstimatorResult& one : result.estimators) {
    for (const auto& [key, value] : one.*values) keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

/// A unit with the prefix that makes numbers of this size easy to read, and what to multiply by.
struct Scaled {
  double factor = 1.0;
  std::string unit;
};

Scaled ScaleUnit(const std::string& unit, double largest) {
  const std::string_view base = std::string_view(unit).substr(0, unit.find('/'));
  const bool takes_prefix = base == "m" || base == "s" || base == "rad";
  if (!takes_prefix || !(largest > 0.0) || largest >= 1.0) return {1.0, unit};
  return largest >= 1e-3 ? Scaled{1e3, 'm' + unit} : Scaled{1e6, 'u' + unit};
}

using Values = std::vector<std::optional<double>>;

/// Cells with four significant digits each, and all of those before the point. What is below 1e-5
/// or from 1e7 on is in scientific notation.
std::vector<std::string> Format(const Values& values) {
  constexpr double kSmall = 1e-5, kLarge = 1e7;
  const auto decimals = [](double v) {
    return std::clamp(3 - static_cast<int>(std::floor(std::log10(v))), 0, 9);
  };
  std::vector<std::string> cells;
  for (const auto& value : values) {
    if (!value) {
      cells.emplace_back("-");
    } else if (!std::isfinite(*value)) {
      cells.push_back(NumberText(*value));
    } else if (*value == 0.0) {
      cells.emplace_back("0");
    } else if (std::abs(*value) < kLarge && std::abs(*value) > kSmall) {
      cells.push_back(FixedText(*value, decimals(std::abs(*value))));
    } else {
      cells.push_back(ScientificText(*value, 3));
    }
  }
  return cells;
}

std::string UnitOfKey(const RunResult& result, const std::string& key) {
  for (const EstimatorResult& one : result.estimators) {
    const auto unit = one.units.find(std::string(SubjectOf(key)));
    if (unit != one.units.end()) return unit->second;
  }
  return {};
}

Values ValuesOf(const RunResult& result, const std::string& key) {
  Values values;
  for (const EstimatorResult& one : result.estimators) {
    const auto found = one.metrics.find(key);
    values.push_back(found == one.metrics.end() ? std::nullopt : std::optional(found->second));
  }
  return values;
}

/// Errors and differences, in the unit of their block.
bool IsError(std::string_view kind) {
  return kind == "rmse" || kind == "implied.rmse" || kind == "final_error" || kind == "rmsd" ||
         kind == "final_difference";
}

/// Errors and differences of paths and maps, in m.
bool IsLength(std::string_view kind) {
  return kind == "map.rmse" || kind == "map.sim3.rmse" || kind == "map.rmsd" ||
         kind == "map.sim3.rmsd" || kind == "trajectory.sim3.rmsd" ||
         kind == "trajectory.sim3.rmse";
}

/// The largest finite RMSE of all blocks with that unit: one prefix serves the whole table. Without
/// a truth it is the largest difference.
double LargestRmse(const RunResult& result, const std::string& unit) {
  double largest = 0.0;
  for (const std::string& key : Keys(result, &EstimatorResult::metrics)) {
    const bool along = KindOf(key) == "rmse" || KindOf(key) == "rmsd";
    if (!along || UnitOfKey(result, key) != unit) continue;
    for (const auto& value : ValuesOf(result, key)) {
      if (value && std::isfinite(*value)) largest = std::max(largest, *value);
    }
  }
  return largest;
}

TableRow RowOf(const RunResult& result, const std::string& key) {
  const std::string_view kind = KindOf(key);
  Values values = ValuesOf(result, key);
  Scaled scaled;
  if (IsError(kind)) {
    const std::string unit = UnitOfKey(result, key);
    scaled = ScaleUnit(unit, LargestRmse(result, unit));
  }
  if (kind == "lag_ms") scaled.unit = "ms";
  if (IsLength(kind)) scaled = ScaleUnit("m", LargestRmse(result, "m"));
  if (kind == "coverage95" || kind == "nees.within95") scaled = {100.0, "%"};
  for (auto& value : values) {
    if (value) *value *= scaled.factor;
  }
  std::string label(kind == "lag_ms" ? "lag" : kind);
  if (key.size() > kind.size()) label.append(" ").append(key.substr(kind.size() + 1));
  if (const std::size_t at = label.find('@'); at != label.npos) label.insert(at, " ");
  if (!scaled.unit.empty()) label.append(" [").append(scaled.unit).append("]");
  return {label, Format(values)};
}

/// Whether every estimator has the subject without any error, as a block that is held at truth.
bool IsExact(const RunResult& result, std::string_view subject) {
  for (const char* kind : {"rmse:", "nees.mean:"}) {
    const Values values = ValuesOf(result, std::string(kind).append(subject));
    const auto wrong = [](const auto& value) { return value && *value != 0.0; };
    const auto known = [](const auto& value) { return value.has_value(); };
    if (std::any_of(values.begin(), values.end(), wrong)) return false;
    if (std::any_of(values.begin(), values.end(), known)) return true;
  }
  return false;
}

/// Over segments a person wants errors and coverage; the rest is in comparison.csv.
bool IsMain(const RunResult& result, const std::string& key) {
  const std::string_view kind = KindOf(key);
  if (IsExact(result, SubjectOf(key))) return false;
  if (key.find('@') != key.npos) {
    return kind == "rmse" || kind == "coverage95" || kind == "nees.within95";
  }
  return std::find(kOrder.begin(), kOrder.end(), kind) != kOrder.end();
}

/// The main metrics and the counts whose keys are `wanted`.
template <class Wanted>
std::vector<TableRow> RowsWhere(const RunResult& result, const Wanted& wanted) {
  std::vector<TableRow> rows;
  for (const std::string& key : OrderedMetrics(result)) {
    if (IsMain(result, key) && wanted(key)) rows.push_back(RowOf(result, key));
  }
  for (const std::string& key : OrderedCounts(result)) {
    if (!wanted(key)) continue;
    TableRow row{std::string(KindOf(key)) + ' ' + std::string(SubjectOf(key)), {}};
    for (const EstimatorResult& one : result.estimators) {
      const auto count = one.counts.find(key);
      row.cells.push_back(count == one.counts.end() ? "-" : std::to_string(count->second));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

void AddHealthRows(const RunResult& result, std::vector<TableRow>& rows) {
  TableRow diverged{"diverged", {}}, inconsistent{"inconsistent", {}};
  for (const EstimatorResult& one : result.estimators) {
    diverged.cells.emplace_back(one.diverged ? "yes" : "no");
    inconsistent.cells.emplace_back(one.inconsistent ? "yes" : "no");
  }
  rows.push_back(std::move(diverged));
  rows.push_back(std::move(inconsistent));
}

constexpr std::size_t kMainRows = 10;

/// The keys of MainRows but for the two of health.
std::set<std::string> MainKeys(const RunResult& result, const std::vector<std::string>& subjects) {
  constexpr std::array<std::string_view, 8> kDealt = {"rmse",          "nees.mean",   "nis.mean",
                                                      "accepted",      "coverage95",  "map.rmse",
                                                      "map.sim3.rmse", "reprojection"};
  // Turn, kind, key.
  std::vector<std::tuple<std::size_t, std::size_t, std::string>> dealt;
  for (std::size_t kind = 0; kind < kDealt.size(); ++kind) {
    std::vector<std::pair<std::size_t, std::string>> keys;
    const auto take = [&](const std::vector<std::string>& candidates, bool is_count) {
      for (const std::string& key : candidates) {
        if (KindOf(key) != kDealt[kind] || key.find('@') != key.npos) continue;
        if (!is_count && !IsMain(result, key)) continue;
        const auto place = std::find(subjects.begin(), subjects.end(), SubjectOf(key));
        keys.emplace_back(static_cast<std::size_t>(place - subjects.begin()), key);
      }
    };
    take(Keys(result, &EstimatorResult::metrics), false);
    take(Keys(result, &EstimatorResult::counts), true);
    std::sort(keys.begin(), keys.end());
    for (std::size_t turn = 0; turn < keys.size(); ++turn) {
      dealt.emplace_back(turn, kind, keys[turn].second);
    }
  }
  std::sort(dealt.begin(), dealt.end());
  std::set<std::string> chosen;
  for (std::size_t i = 0; i < std::min(dealt.size(), kMainRows - 2); ++i) {
    chosen.insert(std::get<2>(dealt[i]));
  }
  return chosen;
}

std::string TableOf(const RunResult& result, const std::vector<TableRow>& rows) {
  const std::string reference = ReferenceText(result);
  return RightAlignedTable(NamesOf(result.estimators), rows) +
         (reference.empty() ? "" : '\n' + reference + '\n');
}

}  // namespace

std::vector<std::string> OrderedMetrics(const RunResult& result) {
  std::vector<std::string> keys = Keys(result, &EstimatorResult::metrics);
  std::stable_sort(keys.begin(), keys.end(),
                   [](const auto& a, const auto& b) { return Rank(a) < Rank(b); });
  return keys;
}

std::vector<std::string> OrderedCounts(const RunResult& result) {
  std::vector<std::string> keys = Keys(result, &EstimatorResult::counts);
  std::stable_partition(keys.begin(), keys.end(),
                        [](const auto& key) { return KindOf(key) == "accepted"; });
  return keys;
}

std::vector<TableRow> MetricRows(const RunResult& result) {
  return RowsWhere(result, [](const std::string&) { return true; });
}

std::vector<TableRow> RowsOf(const RunResult& result, const std::vector<RowKind>& kinds) {
  std::vector<TableRow> rows;
  for (const RowKind& kind : kinds) {
    for (const std::string& key : Keys(result, &EstimatorResult::metrics)) {
      if (KindOf(key) != kind.kind || key.find('@') != key.npos) continue;
      if (IsExact(result, SubjectOf(key))) continue;
      TableRow row = RowOf(result, key);
      row.label = kind.label + row.label.substr(std::min(KindOf(key).size(), row.label.size()));
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::vector<TableRow> ComparisonRows(const RunResult& result) {
  std::vector<TableRow> rows = MetricRows(result);
  AddHealthRows(result, rows);
  return rows;
}

std::vector<std::string> SubjectsOf(const Experiment& experiment) {
  std::vector<std::string> subjects;
  const auto add = [&](const std::string& name) {
    if (std::ranges::count(subjects, name) == 0) subjects.push_back(name);
  };
  for (const EstimatorSpec& spec : experiment.estimators) {
    for (const Block& block : spec.problem.layout.blocks()) {
      add(block.name);
      add(block.owner);
    }
    for (const SensorBinding& sensor : spec.problem.sensors) add(sensor.name);
  }
  return subjects;
}

std::vector<TableRow> MainRows(const RunResult& result, const std::vector<std::string>& subjects) {
  std::vector<TableRow> all = ComparisonRows(result);
  if (all.size() <= kMainRows) return all;
  const std::set<std::string> keys = MainKeys(result, subjects);
  std::vector<TableRow> rows =
      RowsWhere(result, [&](const std::string& key) { return keys.contains(key); });
  AddHealthRows(result, rows);
  return rows;
}

std::string MainTable(const RunResult& result, const std::vector<std::string>& subjects) {
  const std::vector<TableRow> rows = MainRows(result, subjects);
  const std::size_t left_out = ComparisonRows(result).size() - rows.size();
  return TableOf(result, rows) +
         (left_out > 0 ? '\n' + std::to_string(left_out) + " more rows: --all\n" : "");
}

std::string ReferenceText(const RunResult& result) {
  if (!result.withheld.empty()) return result.withheld;
  if (result.reference == "truth") return "";
  return "errors are differences from estimator '" + result.reference +
         "', an estimate itself: no coverage, no NEES";
}

}  // namespace internal

std::string ComparisonTable(const RunResult& result) {
  return internal::TableOf(result, internal::ComparisonRows(result));
}

}  // namespace alidade
