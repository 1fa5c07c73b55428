// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/compare/conclusions.h"
#include "alidade/compare/section.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/io/text_table.h"
#include "alidade/report/page_text.h"

namespace alidade {

using internal::kFewRuns;
using internal::RatioText;
using internal::RowsOf;
using internal::Section;
using internal::TableRow;

namespace {

/// Selection of the rows of one metric, or of the ratios of this metric to that of the reference.
struct RowKind {
  std::string metric, label;
  bool is_ratio = false;
};

/// Column of a table: the values of one estimator.
struct Column {
  std::string name;
  std::map<std::string, Spread> values;
  std::map<std::string, std::string> units;
  std::map<std::string, Ratio> ratios = {};
};

/// Returns the rows with the ratios of a metric.
std::vector<TableRow> RatioRows(const std::vector<Column>& columns, const RowKind& kind,
                                bool with_intervals) {
  std::map<std::string, TableRow> rows;  // key: key of the ratio
  for (const Column& column : columns) {
    for (const auto& [key, ratio] : column.ratios) {
      const MetricKey parsed = MetricKey::Parse(key);
      if (parsed.name != kind.metric) continue;
      rows[key].label = kind.label + (parsed.subject.empty() ? "" : ' ' + parsed.subject);
    }
  }
  std::vector<TableRow> sorted_rows;
  for (auto& [key, row] : rows) {
    for (const Column& column : columns) {
      const auto found = column.ratios.find(key);
      row.cells.push_back(found == column.ratios.end() ? "-"
                                                       : RatioText(found->second, with_intervals));
    }
    sorted_rows.push_back(std::move(row));
  }
  return sorted_rows;
}

/// Returns rows with the mean. If `with_intervals` is true, the rows also contain [p05, p95]. The
/// three numbers are formatted as columns of one table, so all numbers of a row have the same unit.
std::vector<TableRow> SpreadRows(const std::vector<Column>& columns, bool with_intervals,
                                 const std::vector<RowKind>& kinds) {
  RunResult result;
  for (const Column& column : columns) {
    for (const auto member : {&Spread::mean, &Spread::p05, &Spread::p95}) {
      EstimatorResult& estimator = result.estimators.emplace_back();
      estimator.units = column.units;
      for (const auto& [key, spread] : column.values) estimator.metrics[key] = spread.*member;
    }
  }
  std::vector<TableRow> rows;
  for (const RowKind& kind : kinds) {
    if (kind.is_ratio) {
      const std::vector<TableRow> ratios = RatioRows(columns, kind, with_intervals);
      rows.insert(rows.end(), ratios.begin(), ratios.end());
      continue;
    }
    for (TableRow& row : RowsOf(result, kind.metric, kind.label)) {
      std::vector<std::string> cells;
      for (std::size_t i = 0; i < row.cells.size(); i += 3) {
        const std::string* const c = &row.cells[i];
        const bool has_spread = with_intervals && c[0] != "-";
        cells.push_back(has_spread ? c[0] + " [" + c[1] + ", " + c[2] + ']' : c[0]);
      }
      rows.push_back({row.label, std::move(cells)});
    }
  }
  return rows;
}

std::vector<std::string> Names(const std::vector<Column>& columns) {
  std::vector<std::string> names;
  for (const Column& column : columns) names.push_back(column.name);
  return names;
}

/// Adds the references of the columns to a table. If all columns have the same reference, its name
/// is added to the title. Otherwise a row with the references is added.
void AppendReferences(const std::vector<std::string>& references, Section& section) {
  std::set<std::string> distinct(references.begin(), references.end());
  distinct.erase("");
  if (distinct.size() == 1) {
    section.title += "; ratios and differences relative to " + *distinct.begin();
  } else if (distinct.size() > 1) {
    section.title += "; ratios and differences relative to the reference of each column";
    TableRow row{"reference", {}};
    for (const std::string& name : references) row.cells.push_back(name.empty() ? "-" : name);
    section.rows.push_back(row);
  }
}

/// Returns the table of estimators with their references. If the reference is missing in some runs,
/// a row reports the number of runs with a reference.
Section TableOf(const std::vector<ComparedEstimator>& estimators, bool several,
                const std::string& title, std::string ComparedEstimator::*reference,
                std::int64_t ComparedEstimator::*reference_runs, ReportRows shown,
                const std::vector<RowKind>& kinds) {
  Section section;
  section.title = title;
  section.transposed = several;
  std::vector<Column> columns;
  std::vector<std::string> references;
  TableRow with_reference{"runs with a reference", {}};
  bool any_missing = false;
  for (const ComparedEstimator& estimator : estimators) {
    columns.push_back({estimator.name, estimator.values, estimator.units, estimator.ratios});
    references.push_back(estimator.*reference);
    with_reference.cells.push_back(std::to_string(estimator.*reference_runs));
    any_missing = any_missing ||
                  (estimator.*reference_runs > 0 && estimator.*reference_runs < estimator.used);
  }
  section.columns = Names(columns);
  const std::vector<TableRow> rows =
      SpreadRows(columns, several && shown == ReportRows::kAll, kinds);
  if (rows.empty()) return section;
  AppendReferences(references, section);
  section.rows.insert(section.rows.end(), rows.begin(), rows.end());
  if (any_missing) section.rows.push_back(with_reference);
  return section;
}

/// Returns the rows of a section. The main rows are errors if truth is known, otherwise
/// differences.
std::vector<RowKind> KindsOf(const Comparison& comparison, MetricSection section, ReportRows rows) {
  const bool has_cpu_time = std::ranges::any_of(
      comparison.estimators,
      [](const ComparedEstimator& estimator) { return estimator.values.contains("cpu_us"); });
  std::vector<RowKind> kinds;
  for (const MetricInfo& metric : kMetrics) {
    const bool is_main =
        metric.is_main &&
        (metric.is_cost || metric.needs_truth == (comparison.reference == "truth"));
    if (metric.section != section || (rows != ReportRows::kAll && !is_main)) continue;
    if (has_cpu_time && std::string_view(metric.name) == "time_us") continue;
    if (metric.is_ratio) {
      kinds.push_back({metric.name, metric.label, true});
      continue;
    }
    kinds.push_back({metric.name, metric.label});
    if (!metric.has_ratio) continue;
    const bool has_blocks = metric.subject == MetricSubject::kBlock;
    kinds.push_back(
        {metric.name, has_blocks ? "  ratio" : std::string("  ratio, ") + metric.label, true});
  }
  return kinds;
}

/// Returns rows with the share of timestamps at which the average NEES over the runs is within the
/// bounds.
std::vector<TableRow> AverageNeesRows(const std::vector<ComparedEstimator>& estimators) {
  std::set<std::string> owners;
  for (const ComparedEstimator& estimator : estimators) {
    for (const auto& [owner, nees] : estimator.over_time.nees) owners.insert(owner);
  }
  std::vector<TableRow> rows;
  for (const std::string& owner : owners) {
    TableRow& row = rows.emplace_back(TableRow{"ANEES in its bounds " + owner + " [%]", {}});
    for (const ComparedEstimator& estimator : estimators) {
      const auto found = estimator.over_time.nees.find(owner);
      const bool is_known = found != estimator.over_time.nees.end();
      row.cells.push_back(is_known ? internal::RoundedText(100.0 * found->second.inside, 3) : "-");
    }
  }
  return rows;
}

/// Returns the verdict of a single run. For several runs, returns the number of runs with each
/// verdict, as in `2 lost, 18 consistent`.
std::string VerdictText(const ComparedEstimator& estimator, bool several) {
  std::vector<std::string> parts;
  for (const VerdictInfo& verdict : kVerdicts) {
    const std::int64_t count = estimator.verdicts[static_cast<std::size_t>(verdict.state)];
    if (count > 0) parts.push_back((several ? std::to_string(count) + ' ' : "") + verdict.name);
  }
  return internal::Join(parts);
}

/// Returns the section with the values over the run, either of the online estimators or of the
/// smoothed estimators.
Section AlongSection(const Comparison& comparison, bool smoothed, ReportRows rows) {
  std::vector<ComparedEstimator> estimators;
  const bool several = comparison.runs > 1;
  TableRow verdict{"verdict", {}}, used{"runs used", {}};
  for (const ComparedEstimator& estimator : comparison.estimators) {
    if (estimator.smoothed != smoothed) continue;
    estimators.push_back(estimator);
    verdict.cells.push_back(VerdictText(estimator, several));
    used.cells.push_back(std::to_string(estimator.used));
  }
  if (estimators.empty()) return {};
  Section section = TableOf(estimators, several,
                            smoothed ? "Smoothed: estimates that also use later data"
                                     : "Online: estimates that use only past data",
                            &ComparedEstimator::reference, &ComparedEstimator::reference_runs, rows,
                            KindsOf(comparison, MetricSection::kAlong, rows));
  const std::vector<TableRow> average_nees = AverageNeesRows(estimators);
  section.rows.insert(section.rows.end(), average_nees.begin(), average_nees.end());
  section.rows.push_back(verdict);
  if (several) section.rows.push_back(used);
  return section;
}

Section FinalSection(const Comparison& comparison, ReportRows rows) {
  return TableOf(comparison.estimators, comparison.runs > 1,
                 "At the end, when all estimators have the same data",
                 &ComparedEstimator::final_reference, &ComparedEstimator::final_reference_runs,
                 rows, KindsOf(comparison, MetricSection::kFinal, rows));
}

/// Returns the values whose keys start with `kind`. In the keys, `new_kind` replaces `kind`.
std::map<std::string, Spread> WithKind(const std::map<std::string, Spread>& values,
                                       const std::string& kind, const std::string& new_kind) {
  std::map<std::string, Spread> found;
  for (const auto& [key, value] : values) {
    if (key.starts_with(kind)) found[new_kind + key.substr(kind.size())] = value;
  }
  return found;
}

/// Formats the distances in sigmas in descending order, as in `0.06 (target)`. Sets `largest` to
/// the largest distance.
std::string DistancesText(const DecompositionStep& step, double& largest) {
  std::vector<std::pair<double, std::string>> sigmas;
  const std::string kind = "rmsd.sigmas:";
  for (const auto& [key, value] : step.values) {
    if (key.starts_with(kind)) sigmas.emplace_back(value.mean, key.substr(kind.size()));
  }
  std::ranges::sort(sigmas, std::greater());
  largest = sigmas.empty() ? 0.0 : sigmas.front().first;
  std::vector<std::string> parts;
  for (const auto& [value, owner] : sigmas) {
    parts.push_back(internal::RoundedText(value, 3) + " (" + owner + ')');
  }
  return internal::Join(parts);
}

/// Describes the meaning of a step of the decomposition.
std::string MeaningOf(DecompositionKind kind) {
  switch (kind) {
    case DecompositionKind::kLinearisation:
      return "cost of linearising each measurement only once, at the filter's current estimate";
    case DecompositionKind::kSmoothing:
      return "gain from later data, which a smoother can use but a filter cannot";
    case DecompositionKind::kRejected:
      break;
  }
  return "gain from the measurements that the gate and other checks of the filter rejected";
}

/// Describes the distance between the estimators of a step. Returns "" if the distance is unknown.
std::string DistanceLine(const DecompositionStep& step) {
  double largest = 0.0;
  const std::string distances = DistancesText(step, largest);
  if (distances.empty()) return "";
  const std::string line = std::string(step.at_end ? "difference" : "RMSD") + " between " +
                           step.estimator + " and " + step.reference + ", in sigmas of " +
                           step.reference + ": " + distances;
  if (step.kind == DecompositionKind::kSmoothing) return line;
  constexpr double kNegligible = 0.1, kSmall = 0.5, kLarge = 1.0;
  return line + (largest < kNegligible ? "; negligible: far below the remaining uncertainty"
                 : largest < kSmall    ? "; small: below half of the remaining uncertainty"
                 : largest < kLarge    ? "; not small: comparable with the remaining uncertainty"
                                       : "; large: above the remaining uncertainty");
}

/// Returns `3 of 226 measurements were not used by the filter`, or "" if the counts are unknown.
std::string RejectedText(const DecompositionStep& step) {
  const auto rejected = step.values.find("rejected"), total = step.values.find("measurements");
  if (rejected == step.values.end() || total == step.values.end()) return "";
  return internal::RoundedText(rejected->second.mean, 6) + " of " +
         internal::RoundedText(total->second.mean, 6) + " measurements were not used by the filter";
}

Section DecompositionSection(const Comparison& comparison, const DecompositionStep& step) {
  Section section;
  const std::string pair = step.estimator.empty() || step.reference.empty()
                               ? ""
                               : ", " + step.estimator + " compared with " + step.reference;
  section.title = ToString(step.kind);
  std::ranges::replace(section.title, '_', ' ');
  section.title += pair + (step.at_end ? ", at the last frame" : "");
  section.lines.push_back(MeaningOf(step.kind));
  if (step.at_end) {
    section.lines.emplace_back(
        "at the last frame, the batch of all data equals the full-information filter");
  }
  if (step.kind == DecompositionKind::kRejected) {
    const std::string text = RejectedText(step);
    if (!text.empty()) {
      section.lines.push_back(text + (comparison.runs > 1 ? ", mean of the runs" : ""));
    }
  }
  const auto rejected = step.values.find("rejected");
  if (rejected != step.values.end() && rejected->second.mean == 0.0) return section;
  if (!step.withheld.empty()) {
    section.lines.push_back("not available: " + step.withheld);
    return section;
  }
  std::map<std::string, std::string> units;
  for (const ComparedEstimator& estimator : comparison.estimators) {
    units.insert(estimator.units.begin(), estimator.units.end());
  }
  if (step.at_end) units["map"] = units["map.sim3"] = "m";
  const bool several = comparison.runs > 1;
  std::vector<Column> columns = {
      {step.estimator, WithKind(step.values, "rmse.from:", "rmse:"), units},
      {step.reference, WithKind(step.values, "rmse.to:", "rmse:"), units},
      {"ratio", {}, {}},
      {step.at_end ? "difference" : "RMSD", WithKind(step.values, "rmsd:", "rmse:"), units}};
  if (columns[0].values.empty()) columns.erase(columns.begin(), columns.begin() + 3);
  section.columns = Names(columns);
  section.rows = SpreadRows(columns, several, {{"rmse", ""}});
  for (TableRow& row : section.rows) {
    row.label.erase(0, row.label.find_first_not_of(' '));
    const std::string block = row.label.substr(0, row.label.find(' '));
    if (block == "map.sim3") row.label.replace(0, block.size(), "Sim3-aligned map");
    const auto ratio = step.ratios.find("rmse:" + block);
    if (ratio != step.ratios.end()) row.cells[2] = RatioText(ratio->second);
  }
  if (const std::string line = DistanceLine(step); !line.empty()) section.lines.push_back(line);
  return section;
}

/// Returns the names of all references of the last estimates.
std::string ReferencesText(const Comparison& comparison) {
  std::vector<std::string> names;
  for (const ComparedEstimator& estimator : comparison.estimators) {
    const std::string& name = estimator.final_reference;
    if (!name.empty() && std::ranges::count(names, name) == 0) names.push_back(name);
  }
  return names.empty() ? comparison.reference : internal::Join(names);
}

constexpr const char* kBoundRatio = "mse_by_bound";

/// Returns lines that define the ratios and their intervals.
std::vector<std::string> RatioLines(const Comparison& comparison, ReportRows rows) {
  bool has_reference_ratio = false, has_bound_ratio = false;
  for (const ComparedEstimator& estimator : comparison.estimators) {
    for (const auto& [key, ratio] : estimator.ratios) {
      const bool is_bound_ratio = key.starts_with(kBoundRatio);
      has_bound_ratio = has_bound_ratio || is_bound_ratio;
      has_reference_ratio =
          has_reference_ratio || (!is_bound_ratio && ratio.error != ratio.reference_error);
    }
  }
  std::vector<std::string> lines;
  if (has_reference_ratio && comparison.runs == 1) {
    lines.emplace_back(
        "the ratios are from one run and have no confidence interval; use --runs N to compute one");
  } else if (has_reference_ratio) {
    lines.push_back(std::string("ratio: mean error over the runs / mean error of the reference ") +
                    (rows == ReportRows::kAll ? "[95 % interval, paired "
                                              : "+- half of the 95 % interval (paired ") +
                    "bootstrap over the runs" + (rows == ReportRows::kAll ? "]" : ")") +
                    "; undecided: the interval includes 1" +
                    (comparison.runs < kFewRuns
                         ? "; too few runs: with fewer than " + std::to_string(kFewRuns) +
                               " runs the interval is too narrow for a decision"
                         : std::string()));
  }
  if (has_bound_ratio) {
    lines.emplace_back(
        "MSE / Cramer-Rao bound: mean square error / smallest mean square error of an unbiased "
        "filter [95 % interval], mean over the timestamps and the runs");
  }
  return lines;
}

std::vector<Section> SectionsOf(const Comparison& comparison, ReportRows rows) {
  std::vector<Section> sections;
  const auto conclusions = internal::ConclusionLines(internal::ConclusionsOf(comparison));
  if (!conclusions.empty()) sections.push_back({"Conclusions", {}, {}, conclusions});
  Section& head = sections.emplace_back();
  head.title = comparison.runs > 1
                   ? std::to_string(comparison.runs) + " runs, mean" +
                         (rows == ReportRows::kAll ? " [5 % and 95 % quantiles]" : "")
                   : std::to_string(comparison.frames) + " frames";
  head.title += comparison.reference.empty() ? ""
                : comparison.reference == "truth"
                    ? ", errors relative to truth"
                    : ", differences from " + ReferencesText(comparison);
  head.lines = RatioLines(comparison, rows);
  if (!comparison.measurements_sha256.empty()) {
    head.lines.push_back("data sha256 " + comparison.measurements_sha256);
  }
  head.lines.insert(head.lines.end(), comparison.notes.begin(), comparison.notes.end());
  if (!comparison.withheld.empty()) head.lines.push_back(comparison.withheld);
  for (const bool smoothed : {false, true}) {
    Section section = AlongSection(comparison, smoothed, rows);
    if (!section.columns.empty()) sections.push_back(std::move(section));
  }
  Section at_end = FinalSection(comparison, rows);
  if (!at_end.rows.empty()) sections.push_back(std::move(at_end));
  if (comparison.decomposition.empty()) return sections;
  sections.push_back({"Error decomposition of " + comparison.decomposed, {}, {}, {}});
  for (const DecompositionStep& step : comparison.decomposition)
    sections.push_back(DecompositionSection(comparison, step));
  return sections;
}

/// Returns the values and the ratios. A ratio has the key `ratio.KEY`.
internal::Json JsonOf(const std::map<std::string, Spread>& values,
                      const std::map<std::string, Ratio>& ratios, bool several) {
  internal::Json json = internal::Json::object();
  for (const auto& [name, ratio] : ratios) {
    internal::Json& value = json["ratio." + name];
    value = ratio.value();
    if (!several) continue;
    value = {{"value", ratio.value()}, {"runs", ratio.runs}, {"undecided", ratio.undecided()}};
    if (!ratio.interval) continue;
    value["low"] = ratio.interval->low;
    value["high"] = ratio.interval->high;
  }
  for (const auto& [name, spread] : values) {
    internal::Json& value = json[name];
    if (!several) {
      value = spread.mean;
      continue;
    }
    value = {{"mean", spread.mean}, {"p05", spread.p05}, {"p50", spread.p50}, {"p95", spread.p95}};
  }
  return json;
}

/// Returns an array of the numbers. A number that is not finite becomes null.
internal::Json JsonOf(const std::vector<double>& values) {
  internal::Json json = internal::Json::array();
  for (const double value : values) {
    json.push_back(std::isfinite(value) ? internal::Json(value) : internal::Json());
  }
  return json;
}

/// Returns the average NEES of each owner by timestamp.
internal::Json JsonOf(const OverTime& over_time) {
  std::vector<double> t_s;
  for (const Timestamp timestamp : over_time.timestamps) t_s.push_back(Seconds(timestamp));
  internal::Json json = internal::Json::object();
  for (const auto& [owner, nees] : over_time.nees) {
    json[owner] = {
        {"timestamps", nees.timestamps}, {"inside", nees.inside},   {"t_s", JsonOf(t_s)},
        {"mean", JsonOf(nees.mean)},     {"low", JsonOf(nees.low)}, {"high", JsonOf(nees.high)}};
  }
  return json;
}

internal::Json JsonOf(const ComparedEstimator& estimator, bool several) {
  internal::Json verdicts = internal::Json::object();
  for (const VerdictInfo& verdict : kVerdicts) {
    verdicts[verdict.name] = estimator.verdicts[static_cast<std::size_t>(verdict.state)];
  }
  internal::Json json = {{"type", estimator.type},
                         {"smoothed", estimator.smoothed},
                         {"reference", estimator.reference},
                         {"final_reference", estimator.final_reference},
                         {"verdicts", verdicts},
                         {"diverged", estimator.diverged},
                         {"used", estimator.used},
                         {"reference_runs", estimator.reference_runs},
                         {"final_reference_runs", estimator.final_reference_runs},
                         {"values", JsonOf(estimator.values, estimator.ratios, several)},
                         {"units", estimator.units}};
  if (several) json["anees"] = JsonOf(estimator.over_time);
  return json;
}

internal::Json JsonOfDecomposition(const Comparison& comparison) {
  internal::Json steps = internal::Json::array();
  for (const DecompositionStep& step : comparison.decomposition) {
    internal::Json json = {
        {"kind", ToString(step.kind)}, {"from", step.estimator}, {"to", step.reference}};
    if (step.at_end) json["at_end"] = true;
    if (!step.withheld.empty()) json["withheld"] = step.withheld;
    json["values"] = JsonOf(step.values, step.ratios, comparison.runs > 1);
    steps.push_back(std::move(json));
  }
  return {{"filter", comparison.decomposed}, {"steps", std::move(steps)}};
}

}  // namespace

std::string CompareReport(const Comparison& comparison, TableStyle style, ReportRows rows,
                          std::size_t width) {
  std::vector<Section> sections = SectionsOf(comparison, rows);
  const auto count = [](const std::vector<Section>& counted) {
    std::size_t sum = 0;
    for (const Section& section : counted) sum += section.rows.size();
    return sum;
  };
  const std::size_t omitted = count(SectionsOf(comparison, ReportRows::kAll)) - count(sections);
  if (omitted > 0) {
    sections.push_back({std::to_string(omitted) + " more rows: --all", {}, {}, {}});
  }
  return internal::SectionsText(sections, style, width);
}

std::string CompareJson(const Comparison& comparison) {
  internal::Json json = {{"runs", comparison.runs},
                         {"frames", comparison.frames},
                         {"status", ToString(comparison.status)},
                         {"reference", comparison.reference}};
  if (!comparison.withheld.empty()) json["withheld"] = comparison.withheld;
  if (!comparison.measurements_sha256.empty()) {
    json["measurements_sha256"] = comparison.measurements_sha256;
  }
  internal::Json& estimators = json["estimators"] = internal::Json::object();
  for (const ComparedEstimator& estimator : comparison.estimators) {
    estimators[estimator.name] = JsonOf(estimator, comparison.runs > 1);
  }
  if (!comparison.decomposition.empty()) json["decomposition"] = JsonOfDecomposition(comparison);
  json["notes"] = comparison.notes;
  json["conclusions"] = internal::ConclusionsJson(internal::ConclusionsOf(comparison));
  return internal::JsonText(json);
}

void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder,
                     bool force) {
  internal::OutputFolder out(folder, force);
  out.Write("compare.json", CompareJson(comparison));
  out.Write("compare.md", CompareReport(comparison, TableStyle::kMarkdown));
  out.Write("compare.tex", CompareReport(comparison, TableStyle::kLatex));
  internal::CommitWithPage(out);
}

}  // namespace alidade
