// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metric_rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
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

/// Unit with an SI prefix that suits the magnitude of the numbers, and the factor that converts the
/// numbers to this unit.
struct ScaledUnit {
  double factor = 1.0;
  std::string unit;
};

ScaledUnit ScaleUnit(const std::string& unit, double largest) {
  const std::string_view base = std::string_view(unit).substr(0, unit.find('/'));
  const bool allows_prefix = base == "m" || base == "s" || base == "rad";
  if (!allows_prefix || !(largest > 0.0) || largest >= 1.0) return {1.0, unit};
  return largest >= 1e-3 ? ScaledUnit{1e3, 'm' + unit} : ScaledUnit{1e6, 'u' + unit};
}

using Values = std::vector<std::optional<double>>;

/// Returns cells with at least four significant digits and all digits before the decimal point.
/// Uses scientific notation for magnitudes of at most 1e-5 or at least 1e7.
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

/// Returns the name of a metric for a table. Omits the unit, because the label contains it in
/// brackets.
std::string ShownName(const std::string& name) { return name == "lag_ms" ? "lag" : name; }

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

/// Returns the rows of the shown metrics and of the counts whose keys satisfy `is_included`.
template <class Predicate>
std::vector<TableRow> SelectRows(const RunResult& result, const Predicate& is_included) {
  std::vector<TableRow> rows;
  for (const std::string& text : OrderedMetrics(result)) {
    const MetricKey key = MetricKey::Parse(text);
    if (!IsShown(result, key) || !is_included(text)) continue;
    rows.push_back(RowOf(result, text, ShownName(key.name)));
  }
  for (const std::string& text : OrderedCounts(result)) {
    if (!is_included(text)) continue;
    const MetricKey key = MetricKey::Parse(text);
    TableRow row{key.name + (key.subject.empty() ? "" : ' ' + key.subject), {}};
    for (const EstimatorResult& estimator : result.estimators) {
      const auto count = estimator.counts.find(text);
      row.cells.push_back(count == estimator.counts.end() ? "-" : std::to_string(count->second));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Adds the row of the verdicts before the other rows.
void AddVerdictRow(const RunResult& result, std::vector<TableRow>& rows) {
  TableRow verdict{"verdict", {}};
  for (const EstimatorResult& estimator : result.estimators) {
    verdict.cells.emplace_back(ToString(estimator.verdict.state));
  }
  rows.insert(rows.begin(), std::move(verdict));
}

constexpr std::size_t kMainRows = 10;

/// Returns the priority of a metric or count in MainRows(); 0 if it is never a main row.
int PriorityOf(const MetricKey& key) {
  constexpr int kAcceptedPriority = 4;
  if (!key.segment.empty()) return 0;
  if (key.name == ToString(Outcome::kAccepted)) return kAcceptedPriority;
  const MetricInfo* const metric = FindMetric(key.name);
  return metric == nullptr ? 0 : metric->priority;
}

/// Returns the keys of MainRows() without the verdict. Each round chooses one
/// subject of each metric.
std::set<std::string> MainKeys(const RunResult& result, const std::vector<std::string>& subjects) {
  // Each pair consists of the index of a subject and a key.
  std::map<int, std::vector<std::pair<std::size_t, std::string>>> by_priority;
  const auto add = [&](const std::vector<std::string>& candidates, bool is_count) {
    for (const std::string& text : candidates) {
      const MetricKey key = MetricKey::Parse(text);
      const int priority = PriorityOf(key);
      if (priority == 0 || (!is_count && !IsShown(result, key))) continue;
      const auto position = std::find(subjects.begin(), subjects.end(), key.subject);
      by_priority[priority].emplace_back(position - subjects.begin(), text);
    }
  };
  add(Keys(result, &EstimatorResult::metrics), false);
  add(Keys(result, &EstimatorResult::counts), true);
  std::vector<std::tuple<std::size_t, int, std::string>> ranked;  // round, priority, key
  for (auto& [priority, keys] : by_priority) {
    std::sort(keys.begin(), keys.end());
    for (std::size_t round = 0; round < keys.size(); ++round) {
      ranked.emplace_back(round, priority, keys[round].second);
    }
  }
  std::sort(ranked.begin(), ranked.end());
  std::set<std::string> chosen;
  for (std::size_t i = 0; i < std::min(ranked.size(), kMainRows - 1); ++i) {
    chosen.insert(std::get<2>(ranked[i]));
  }
  return chosen;
}

std::string TableOf(const RunResult& result, const std::vector<TableRow>& rows) {
  const std::string reference = ReferenceText(result);
  return FormatTable(MakeTable(NamesOf(result.estimators), rows), TableFormat::kText) +
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
  std::stable_partition(keys.begin(), keys.end(), [](const auto& key) {
    return MetricKey::Parse(key).name == ToString(Outcome::kAccepted);
  });
  return keys;
}

std::vector<TableRow> MetricRows(const RunResult& result) {
  return SelectRows(result, [](const std::string&) { return true; });
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
  std::vector<TableRow> rows = MetricRows(result);
  AddVerdictRow(result, rows);
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
  std::vector<TableRow> all_rows = ComparisonRows(result);
  if (all_rows.size() <= kMainRows) return all_rows;
  const std::set<std::string> keys = MainKeys(result, subjects);
  std::vector<TableRow> rows =
      SelectRows(result, [&](const std::string& key) { return keys.contains(key); });
  AddVerdictRow(result, rows);
  return rows;
}

std::string MainTable(const RunResult& result, const std::vector<std::string>& subjects) {
  const std::vector<TableRow> rows = MainRows(result, subjects);
  const std::size_t omitted = ComparisonRows(result).size() - rows.size();
  return TableOf(result, rows) +
         (omitted > 0 ? '\n' + std::to_string(omitted) + " more rows: --all\n" : "");
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

std::string ComparisonTable(const RunResult& result) {
  return internal::TableOf(result, internal::ComparisonRows(result));
}

}  // namespace alidade
