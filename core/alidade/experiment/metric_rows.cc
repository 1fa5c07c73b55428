// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metric_rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/experiment.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/io/text_table.h"

namespace alidade {
namespace internal {
namespace {

/// Returns the sort key of a metric. Shown metrics come first, in the order of kMetrics, and
/// metrics of the whole run come before metrics of segments. The last criterion is the name.
auto Rank(const std::string& text) {
  const MetricKey key = MetricKey::Parse(text);
  const MetricInfo* const metric = FindMetric(key.name);
  const std::size_t index = metric != nullptr && metric->is_shown
                                ? static_cast<std::size_t>(metric - kMetrics.data())
                                : kMetrics.size();
  return std::tuple(index, key.segment, text);
}

template <class Map>
std::vector<std::string> Keys(const RunResult& result, const Map EstimatorResult::*values) {
  std::vector<std::string> keys;
  for (const EstimatorResult& estimator : result.estimators) {
    for (const auto& [key, value] : estimator.*values) keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

/// Unit for a person, and the factor that converts numbers in SI to it.
struct ScaledUnit {
  double factor = 1.0;
  std::string unit;
};

/// Chooses the unit for a person: degrees for angles, and for lengths and times the SI prefix that
/// suits the largest number. Files contain SI units.
ScaledUnit ScaleUnit(const std::string& unit, double largest) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const std::size_t end = std::min(unit.find('/'), unit.size());
  const std::string base = unit.substr(0, end);
  if (base == "rad") return {kDegrees, "deg" + unit.substr(end)};
  const bool allows_prefix = base == "m" || base == "s";
  if (!allows_prefix || !(largest > 0.0) || largest >= 1.0) return {1.0, unit};
  return largest >= 1e-3 ? ScaledUnit{1e3, 'm' + unit} : ScaledUnit{1e6, 'u' + unit};
}

using Values = std::vector<std::optional<double>>;

/// Returns cells with three significant digits and all digits before the decimal point. Uses
/// scientific notation for magnitudes of at most 1e-5 or at least 1e7.
std::vector<std::string> Format(const Values& values) {
  constexpr double kSmall = 1e-5, kLarge = 1e7;
  const auto decimals = [](double v) {  // 9.995 and above are rounded to 10.0
    return std::clamp(2 - static_cast<int>(std::floor(std::log10(v / 0.9995))), 0, 9);
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
      cells.push_back(ScientificText(*value, 2));
    }
  }
  return cells;
}

std::string UnitOfKey(const RunResult& result, const MetricKey& key) {
  for (const EstimatorResult& estimator : result.estimators) {
    const auto found = estimator.units.find(key.subject);
    if (found != estimator.units.end()) return found->second;
  }
  return {};
}

Values ValuesOf(const RunResult& result, const std::string& key) {
  Values values;
  for (const EstimatorResult& estimator : result.estimators) {
    const auto found = estimator.metrics.find(key);
    values.push_back(found == estimator.metrics.end() ? std::nullopt
                                                      : std::optional(found->second));
  }
  return values;
}

/// Returns the largest finite RMSE of all blocks with this unit. If there is no truth, uses the
/// RMSD instead. The result determines the common unit prefix of the whole table.
double LargestRmse(const RunResult& result, const std::string& unit) {
  double largest = 0.0;
  for (const std::string& text : Keys(result, &EstimatorResult::metrics)) {
    const MetricKey key = MetricKey::Parse(text);
    if ((key.name != "rmse" && key.name != "rmsd") || UnitOfKey(result, key) != unit) continue;
    for (const auto& value : ValuesOf(result, text)) {
      if (value && std::isfinite(*value)) largest = std::max(largest, *value);
    }
  }
  return largest;
}

/// Returns the unit of a metric in a table, with the factor of its values.
ScaledUnit ScaledUnitOf(const RunResult& result, const MetricKey& key) {
  const MetricInfo* const metric = FindMetric(key.name);
  if (metric == nullptr) return {};
  switch (metric->unit) {
    case MetricUnit::kSubject: {
      const std::string unit = UnitOfKey(result, key);
      return ScaleUnit(unit, LargestRmse(result, unit));
    }
    case MetricUnit::kMetre:
      return ScaleUnit("m", LargestRmse(result, "m"));
    case MetricUnit::kMillisecond:
      return {1.0, "ms"};
    case MetricUnit::kShare:
      return {100.0, "%"};
    case MetricUnit::kMicrosecond:  // the label includes the unit
    case MetricUnit::kFrames:
    case MetricUnit::kNone:
      break;
  }
  return {};
}

/// Returns the row of a metric. The label consists of `name`, the subject, the segment and the
/// unit.
TableRow RowOf(const RunResult& result, const std::string& text, const std::string& name) {
  const MetricKey key = MetricKey::Parse(text);
  const ScaledUnit scaled = ScaledUnitOf(result, key);
  Values values = ValuesOf(result, text);
  for (auto& value : values) {
    if (value) *value *= scaled.factor;
  }
  std::string label = name;
  if (!key.subject.empty()) label.append(" ").append(key.subject);
  if (!key.segment.empty()) label.append(" @").append(key.segment);
  if (!scaled.unit.empty()) label.append(" [").append(scaled.unit).append("]");
  return {label, Format(values)};
}

/// Returns the name of a metric or count for a person.
std::string ShownName(const std::string& name) {
  constexpr std::pair<std::string_view, const char*> kNames[] = {
      {"lag_ms", "lag"},
      {"nees.mean", "NEES"},
      {"nees.within95", "NEES inside 95 % region"},
      {"nis.mean", "NIS"},
      {"nis.all", "NIS with rejected"},
      {"coverage95", "inside 95 % region"},
      {"final_error", "final error"},
  };
  const auto* const found =
      std::ranges::find(kNames, name, [](const auto& pair) { return pair.first; });
  return found == std::end(kNames) ? name : found->second;
}

/// Returns true if the errors of the subject are zero in every estimator, for example because a
/// block is fixed at its true value.
bool IsExact(const RunResult& result, const std::string& subject) {
  for (const char* name : {"rmse", "nees.mean"}) {
    const Values values = ValuesOf(result, MetricKey{name, subject, ""}.text());
    const auto is_wrong = [](const auto& value) { return value && *value != 0.0; };
    const auto is_known = [](const auto& value) { return value.has_value(); };
    if (std::any_of(values.begin(), values.end(), is_wrong)) return false;
    if (std::any_of(values.begin(), values.end(), is_known)) return true;
  }
  return false;
}

/// Returns true if tables show the metric. comparison.csv contains all metrics.
bool IsShown(const RunResult& result, const MetricKey& key) {
  const MetricInfo* const metric = FindMetric(key.name);
  if (metric == nullptr || IsExact(result, key.subject)) return false;
  return key.segment.empty() ? metric->is_shown : metric->is_shown_by_segment;
}

/// Formats a count with separators of thousands: `12,345`.
std::string CountText(std::int64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, ",");
  return text;
}

TableRow CountRow(const RunResult& result, const std::string& text) {
  const MetricKey key = MetricKey::Parse(text);
  TableRow row{key.name + (key.subject.empty() ? "" : ' ' + key.subject), {}};
  for (const EstimatorResult& estimator : result.estimators) {
    const auto count = estimator.counts.find(text);
    row.cells.push_back(count == estimator.counts.end() ? "-" : CountText(count->second));
  }
  return row;
}

/// Returns the row with the numbers of used and of all measurements of a sensor.
TableRow UsedRow(const RunResult& result, const std::string& sensor) {
  TableRow row{"used / given " + sensor, {}};
  for (const EstimatorResult& estimator : result.estimators) {
    std::int64_t used = 0, given = 0;
    for (const OutcomeInfo& outcome : kOutcomes) {
      const auto count = estimator.counts.find(MetricKey{outcome.name, sensor, ""}.text());
      if (count == estimator.counts.end()) continue;
      given += count->second;
      if (outcome.is_used) used += count->second;
    }
    row.cells.push_back(given == 0 ? "-" : CountText(used) + '/' + CountText(given));
  }
  return row;
}

/// Returns true if the verdict is bad, and a mean NEES or NIS is outside its 95 % bounds. If the
/// verdict is overconfident or underconfident, only a mean on that side is an alarm.
bool IsAlarm(const EstimatorResult& estimator, const MetricKey& key) {
  const VerdictState state = estimator.verdict.state;
  if (state >= VerdictState::kNotTested || !key.name.ends_with(".mean")) return false;
  const std::string kind = key.name.substr(0, key.name.find('.'));
  const auto value = [&](const std::string& name) {
    const auto found = estimator.metrics.find(MetricKey{name, key.subject, key.segment}.text());
    return found == estimator.metrics.end() ? std::nan("") : found->second;
  };
  const bool is_above = value(key.name) > value(kind + ".high");
  const bool is_below = value(key.name) < value(kind + ".low");
  return (is_above && state != VerdictState::kUnderconfident) ||
         (is_below && state != VerdictState::kOverconfident);
}

/// Returns the row of a metric for the table of a run. Marks alarms by ` !`.
TableRow MarkedRow(const RunResult& result, const std::string& text) {
  const MetricKey key = MetricKey::Parse(text);
  TableRow row = RowOf(result, text, ShownName(key.name));
  for (std::size_t e = 0; e < row.cells.size(); ++e) {
    if (IsAlarm(result.estimators[e], key)) row.cells[e] += " !";
  }
  return row;
}

TableRow VerdictRow(const RunResult& result) {
  TableRow verdict{"verdict", {}};
  for (const EstimatorResult& estimator : result.estimators) {
    verdict.cells.emplace_back(ToString(estimator.verdict.state));
  }
  return verdict;
}

bool IsAccepted(const MetricKey& key) { return key.name == ToString(Outcome::kAccepted); }

/// Returns the row of a key of MainKeys().
TableRow MainRow(const RunResult& result, const std::string& text) {
  const MetricKey key = MetricKey::Parse(text);
  if (IsAccepted(key)) return UsedRow(result, key.subject);
  const std::vector<std::string> counts = Keys(result, &EstimatorResult::counts);
  const bool is_count = std::ranges::binary_search(counts, text);
  return is_count ? CountRow(result, text) : MarkedRow(result, text);
}

/// Returns true if the key is the error of a block that belongs to a sensor, such as a clock
/// offset.
bool IsOfSensor(const RunResult& result, const MetricKey& key) {
  const std::string owner = key.subject.substr(0, key.subject.find('.'));
  const auto has_sensor = [&](const EstimatorResult& estimator) {
    return std::ranges::count(estimator.sensors, owner) > 0;
  };
  return key.subject.size() > owner.size() && std::ranges::any_of(result.estimators, has_sensor);
}

/// Ranks of the errors of blocks, of the errors of states of sensors, and of the measurements. The
/// rank of another metric is twice its priority.
constexpr int kErrorRank = 2, kSensorStateRank = 3, kAcceptedRank = 8;

/// Returns the rank of a metric or count by its relevance, from 1; 0 if it is not relevant. The
/// error of a state of a sensor is its error at the end.
int RankOf(const RunResult& result, const MetricKey& key) {
  if (!key.segment.empty()) return 0;
  if (IsAccepted(key)) return kAcceptedRank;
  if (IsOfSensor(result, key)) return key.name == "final_error" ? kSensorStateRank : 0;
  const MetricInfo* const metric = FindMetric(key.name);
  return metric == nullptr || !IsShown(result, key) ? 0 : 2 * metric->priority;
}

std::string ReferenceLine(const RunResult& result) {
  const std::string reference = ReferenceText(result);
  return reference.empty() ? "" : '\n' + reference + '\n';
}

/// Formats a table with the estimators as columns. If it is wider than a line and shorter with the
/// estimators as rows, exchanges rows and columns.
std::string FittedTable(const Table& table, std::size_t width) {
  const std::string columns = FormatTable(table, TableFormat::kText, width);
  if (columns.find("\n\n") == columns.npos) return columns;
  const std::string rows = FormatTable(Transposed(table), TableFormat::kText, width);
  return std::ranges::count(rows, '\n') < std::ranges::count(columns, '\n') ? rows : columns;
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
  std::stable_partition(keys.begin(), keys.end(), [](const auto& key) {
    return MetricKey::Parse(key).name == ToString(Outcome::kAccepted);
  });
  return keys;
}

std::vector<std::string> ShownMetrics(const RunResult& result) {
  std::vector<std::string> keys = OrderedMetrics(result);
  std::erase_if(keys, [&](const auto& text) { return !IsShown(result, MetricKey::Parse(text)); });
  return keys;
}

std::vector<TableRow> MetricRows(const RunResult& result) {
  return MetricRows(result, ShownMetrics(result));
}

std::vector<TableRow> MetricRows(const RunResult& result, const std::vector<std::string>& keys) {
  std::vector<TableRow> rows;
  for (const std::string& text : keys) {
    rows.push_back(RowOf(result, text, ShownName(MetricKey::Parse(text).name)));
  }
  return rows;
}

std::vector<TableRow> RowsOf(const RunResult& result, const std::string& name,
                             const std::string& label) {
  std::vector<TableRow> rows;
  for (const std::string& text : Keys(result, &EstimatorResult::metrics)) {
    const MetricKey key = MetricKey::Parse(text);
    if (key.name != name || !key.segment.empty() || IsExact(result, key.subject)) continue;
    rows.push_back(RowOf(result, text, label));
  }
  return rows;
}

std::vector<TableRow> ComparisonRows(const RunResult& result) {
  std::vector<TableRow> rows = {VerdictRow(result)};
  for (const std::string& text : ShownMetrics(result)) rows.push_back(MarkedRow(result, text));
  for (const std::string& text : OrderedCounts(result)) rows.push_back(CountRow(result, text));
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

std::vector<std::string> MainKeys(const RunResult& result,
                                  const std::vector<std::string>& subjects) {
  constexpr std::size_t kMainRows = 9, kErrors = 3, kOthers = 2;
  std::vector<std::string> keys = Keys(result, &EstimatorResult::metrics);
  const std::vector<std::string> counted = Keys(result, &EstimatorResult::counts);
  keys.insert(keys.end(), counted.begin(), counted.end());
  std::map<std::pair<int, std::ptrdiff_t>, std::vector<std::string>> by_relevance;
  for (const std::string& text : keys) {
    const MetricKey key = MetricKey::Parse(text);
    const auto position = std::ranges::find(subjects, key.subject) - subjects.begin();
    const int rank = RankOf(result, key);
    if (rank > 0) by_relevance[{rank, position}].push_back(text);
  }
  std::map<int, std::size_t> counts;  // number of keys of each rank
  std::vector<std::string> first, later;
  for (const auto& [relevance, same] : by_relevance) {
    for (const std::string& text : same) {
      const std::size_t limit = relevance.first == kErrorRank ? kErrors : kOthers;
      (counts[relevance.first]++ < limit ? first : later).push_back(text);
    }
  }
  first.insert(first.end(), later.begin(), later.end());
  if (first.size() > kMainRows) first.resize(kMainRows);
  return first;
}

std::string MainTable(const RunResult& result, const std::vector<std::string>& keys,
                      std::size_t width, std::size_t max_lines) {
  std::vector<TableRow> rows = {VerdictRow(result)};
  for (const std::string& text : keys) rows.push_back(MainRow(result, text));
  const std::size_t all_rows = ComparisonRows(result).size();
  while (true) {
    const std::string table =
        FittedTable(MakeTable(NamesOf(result.estimators), rows), width) + ReferenceLine(result) +
        (all_rows > rows.size()
             ? '\n' + std::to_string(all_rows - rows.size()) + " more rows: --all\n"
             : "");
    const auto lines = static_cast<std::size_t>(std::ranges::count(table, '\n'));
    if (lines <= max_lines || rows.size() <= 2) return table;
    rows.pop_back();
  }
}

std::string ValueText(const std::string& key, double value, const std::string& unit) {
  EstimatorResult estimator;
  estimator.metrics[key] = value;
  estimator.units[MetricKey::Parse(key).subject] = unit;
  return ValueText(estimator, key);
}

std::string ValueText(const EstimatorResult& estimator, const std::string& key) {
  RunResult result;
  result.estimators.push_back(estimator);
  const ScaledUnit scaled = ScaledUnitOf(result, MetricKey::Parse(key));
  const std::string number = RoundedText(estimator.metrics.at(key) * scaled.factor, 3);
  return number + (scaled.unit.empty() ? "" : ' ' + scaled.unit);
}

std::string ReferenceText(const RunResult& result) {
  if (!result.withheld.empty()) return result.withheld;
  if (result.reference == "truth") return "";
  return "errors are differences from estimator '" + result.reference +
         "', not from truth; coverage and NEES are not computed";
}

}  // namespace internal

namespace {

/// Returns at most three findings, a line each, without those that the verdict states.
std::string FindingLines(const EstimatorResult& estimator, const std::string& indent) {
  constexpr std::size_t kMaxShown = 3;
  std::string text;
  std::size_t count = 0;
  for (const Finding& finding : estimator.findings) {
    if (estimator.verdict.because.find(finding.text) != std::string::npos) continue;
    if (++count <= kMaxShown) text += indent + finding.text + '\n';
  }
  if (count < 2) return text;
  text += indent + "the first of these findings usually explains the others";
  if (count > kMaxShown) {
    text += "; `alidade diagnose` lists " + std::to_string(count - kMaxShown) + " more";
  }
  return text + '\n';
}

/// Returns the first estimator before `estimator` with the same findings, or null if `estimator`
/// has no finding.
const EstimatorResult* WithSameFindings(const RunResult& result, const EstimatorResult& estimator) {
  for (const EstimatorResult& earlier : result.estimators) {
    if (&earlier == &estimator || estimator.findings.empty()) return nullptr;
    if (std::ranges::equal(earlier.findings, estimator.findings, {}, &Finding::text,
                           &Finding::text))
      return &earlier;
  }
  return nullptr;
}

}  // namespace

std::optional<VerdictState> WorstVerdict(const RunResult& result) {
  std::optional<VerdictState> worst;
  for (const EstimatorResult& estimator : result.estimators) {
    if (estimator.expects_poor) continue;
    worst = worst ? std::min(*worst, estimator.verdict.state) : estimator.verdict.state;
  }
  return worst;
}

std::string VerdictText(const RunResult& result) {
  std::size_t width = 0;
  for (const EstimatorResult& estimator : result.estimators) {
    width = std::max(width, estimator.name.size());
  }
  std::string text;
  for (const EstimatorResult& estimator : result.estimators) {
    const Verdict& verdict = estimator.verdict;
    const std::string indent(width + 2, ' ');
    text += estimator.name + indent.substr(estimator.name.size()) + ToString(verdict.state) +
            (estimator.expects_poor ? " (poor is expected): " : ": ") + verdict.because + '\n';
    const EstimatorResult* const same = WithSameFindings(result, estimator);
    text += same ? indent + "the same findings as for " + same->name + '\n'
                 : FindingLines(estimator, indent);
  }
  return text;
}

std::string ComparisonTable(const RunResult& result, std::size_t width) {
  return FormatTable(internal::MakeTable(internal::NamesOf(result.estimators),
                                         internal::ComparisonRows(result)),
                     internal::TableFormat::kText, width) +
         internal::ReferenceLine(result);
}

}  // namespace alidade
