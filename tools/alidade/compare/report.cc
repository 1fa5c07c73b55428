// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/compare/compare.h"
#include "alidade/compare/section.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/io/text_table.h"

namespace alidade {

using internal::RowsOf;
using internal::Section;
using internal::TableRow;

namespace {

/// The rows of one metric, or of its ratios to the reference.
struct RowKind {
  std::string metric, label;
  bool is_ratio = false;
};

/// A column of a table, in the form that rows are made of.
struct Column {
  std::string name;
  std::map<std::string, Spread> values;
  std::map<std::string, std::string> units;
  std::map<std::string, Ratio> ratios = {};
};

/// A number as the other rows have it.
std::string CellOf(double value) {
  RunResult one;
  one.estimators.resize(1);
  one.estimators[0].metrics["value"] = value;
  return RowsOf(one, "value", "")[0].cells[0];
}

/// Of fewer runs an interval is not what it says: that of three, as of a t distribution, would have
/// to be 2.7 times as wide for its 95 %, that of ten 1.2 times.
constexpr std::int64_t kFewRuns = 10;

/// `1.0110 [0.9930, 1.0302] undecided`
std::string RatioText(const Ratio& ratio) {
  const auto text = [](double value) { return internal::FixedText(value, value < 10.0 ? 4 : 1); };
  if (!ratio.interval || ratio.error == ratio.reference_error) return CellOf(ratio.value());
  return text(ratio.value()) + " [" + text(ratio.interval->low) + ", " +
         text(ratio.interval->high) + ']' +
         (ratio.runs < kFewRuns ? " too few runs"
          : ratio.undecided()   ? " undecided"
                                : "");
}

/// The ratios of a metric.
std::vector<TableRow> RatioRows(const std::vector<Column>& columns, const RowKind& kind) {
  std::map<std::string, TableRow> rows;  // by key
  for (const Column& column : columns) {
    for (const auto& [key, ratio] : column.ratios) {
      const MetricKey parsed = MetricKey::Parse(key);
      if (parsed.name != kind.metric) continue;
      rows[key].label = kind.label + (parsed.subject.empty() ? "" : ' ' + parsed.subject);
    }
  }
  std::vector<TableRow> all;
  for (auto& [key, row] : rows) {
    for (const Column& column : columns) {
      const auto found = column.ratios.find(key);
      row.cells.push_back(found == column.ratios.end() ? "-" : RatioText(found->second));
    }
    all.push_back(std::move(row));
  }
  return all;
}

/// Rows with the mean, and over several runs [p05, p95]. Each column stands as three, so that its
/// numbers share their unit and decimals with all others of the row.
std::vector<TableRow> SpreadRows(const std::vector<Column>& columns, bool several,
                                 const std::vector<RowKind>& kinds) {
  RunResult all;
  for (const Column& column : columns) {
    for (const auto member : {&Spread::mean, &Spread::p05, &Spread::p95}) {
      EstimatorResult& one = all.estimators.emplace_back();
      one.units = column.units;
      for (const auto& [key, spread] : column.values) one.metrics[key] = spread.*member;
    }
  }
  std::vector<TableRow> rows;
  for (const RowKind& kind : kinds) {
    if (kind.is_ratio) {
      const std::vector<TableRow> ratios = RatioRows(columns, kind);
      rows.insert(rows.end(), ratios.begin(), ratios.end());
      continue;
    }
    for (TableRow& row : RowsOf(all, kind.metric, kind.label)) {
      std::vector<std::string> cells;
      for (std::size_t i = 0; i < row.cells.size(); i += 3) {
        const std::string* const c = &row.cells[i];
        const bool spread = several && c[0] != "-";
        cells.push_back(spread ? c[0] + " [" + c[1] + ", " + c[2] + ']' : c[0]);
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

/// What the columns of a table are compared with: in its title, or where they differ in a row.
void TellReferences(const std::vector<std::string>& references, Section& section) {
  std::set<std::string> distinct(references.begin(), references.end());
  distinct.erase("");
  if (distinct.size() == 1) {
    section.title += "; ratio and difference: to " + *distinct.begin();
  } else if (distinct.size() > 1) {
    section.title += "; ratio and difference: to the reference of each";
    TableRow row{"reference", {}};
    for (const std::string& one : references) row.cells.push_back(one.empty() ? "-" : one);
    section.rows.push_back(row);
  }
}

/// A table of `of`, with what they are compared with, and over several runs in how many of them.
Section TableOf(const std::vector<ComparedEstimator>& of, bool several, const std::string& title,
                std::string ComparedEstimator::*reference,
                std::int64_t ComparedEstimator::*reference_runs,
                const std::vector<RowKind>& kinds) {
  Section section;
  section.title = title;
  std::vector<Column> columns;
  std::vector<std::string> references;
  TableRow with_reference{"runs with a reference", {}};
  bool fewer = false;
  for (const ComparedEstimator& one : of) {
    columns.push_back({one.name, one.values, one.units, one.ratios});
    references.push_back(one.*reference);
    with_reference.cells.push_back(std::to_string(one.*reference_runs));
    fewer = fewer || (one.*reference_runs > 0 && one.*reference_runs < one.used);
  }
  section.columns = Names(columns);
  const std::vector<TableRow> rows = SpreadRows(columns, several, kinds);
  if (rows.empty()) return section;
  TellReferences(references, section);
  section.rows.insert(section.rows.end(), rows.begin(), rows.end());
  if (fewer) section.rows.push_back(with_reference);
  return section;
}

/// The rows of a section. The short form has errors if truth is known, else differences.
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
    const bool is_of_blocks = metric.subject == MetricSubject::kBlock;
    kinds.push_back(
        {metric.name, is_of_blocks ? "  ratio" : std::string("  ratio, ") + metric.label, true});
  }
  return kinds;
}

/// The share of timestamps at which the average NEES over the runs is within its bounds.
std::vector<TableRow> AverageNeesRows(const std::vector<ComparedEstimator>& of) {
  std::set<std::string> owners;
  for (const ComparedEstimator& one : of) {
    for (const auto& [owner, nees] : one.over_time.nees) owners.insert(owner);
  }
  std::vector<TableRow> rows;
  for (const std::string& owner : owners) {
    TableRow& row = rows.emplace_back(TableRow{"ANEES in its bounds " + owner + " [%]", {}});
    for (const ComparedEstimator& one : of) {
      const auto found = one.over_time.nees.find(owner);
      const bool known = found != one.over_time.nees.end();
      row.cells.push_back(known ? internal::RoundedText(100.0 * found->second.inside, 3) : "-");
    }
  }
  return rows;
}

/// The estimators along the run, of one kind: filters, or those that know later data.
Section AlongSection(const Comparison& comparison, bool smoothed, ReportRows rows) {
  std::vector<ComparedEstimator> of;
  TableRow diverged{"diverged", {}}, used{"runs used", {}};
  bool any_diverged = false;
  for (const ComparedEstimator& one : comparison.estimators) {
    if (one.smoothed != smoothed) continue;
    of.push_back(one);
    diverged.cells.push_back(std::to_string(one.diverged));
    used.cells.push_back(std::to_string(one.used));
    any_diverged = any_diverged || one.diverged > 0;
  }
  if (of.empty()) return {};
  Section section = TableOf(of, comparison.runs > 1,
                            smoothed ? "Smoothed: estimates from later data too"
                                     : "Online: every estimate from the data up to it",
                            &ComparedEstimator::reference, &ComparedEstimator::reference_runs,
                            KindsOf(comparison, MetricSection::kAlong, rows));
  const std::vector<TableRow> average_nees = AverageNeesRows(of);
  section.rows.insert(section.rows.end(), average_nees.begin(), average_nees.end());
  if (any_diverged) section.rows.push_back(diverged);
  if (comparison.runs > 1) section.rows.push_back(used);
  return section;
}

Section FinalSection(const Comparison& comparison, ReportRows rows) {
  return TableOf(comparison.estimators, comparison.runs > 1,
                 "At the end, where all have the same data", &ComparedEstimator::final_reference,
                 &ComparedEstimator::final_reference_runs,
                 KindsOf(comparison, MetricSection::kFinal, rows));
}

/// The values of one kind by their subject, under another kind.
std::map<std::string, Spread> Under(const std::map<std::string, Spread>& values,
                                    const std::string& kind, const std::string& as) {
  std::map<std::string, Spread> found;
  for (const auto& [key, value] : values) {
    if (key.starts_with(kind)) found[as + key.substr(kind.size())] = value;
  }
  return found;
}

/// `0.06 (target)`, the largest first; the largest itself goes to `largest`.
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

/// What a step of the decomposition means, in words.
std::string WordsOf(DecompositionKind kind) {
  switch (kind) {
    case DecompositionKind::kLinearisation:
      return "what it costs that each measurement is linearised once, where the filter then was";
    case DecompositionKind::kSmoothing:
      return "what later data add to each estimate: a smoother can use it, a filter cannot";
    case DecompositionKind::kRejected:
      break;
  }
  return "what the filter would have gained from what its gate and its other checks kept out";
}

std::string LinesOf(const DecompositionStep& step) {
  double largest = 0.0;
  const std::string distances = DistancesText(step, largest);
  if (distances.empty()) return "";
  std::string line =
      (step.at_end ? "difference " : "RMSD ") + distances + " in sigmas of " + step.to;
  if (step.kind == DecompositionKind::kSmoothing) return line;
  constexpr double kNegligible = 0.1, kSmall = 0.5, kLarge = 1.0;
  return line + (largest < kNegligible ? ": negligible compared with what neither of them knows"
                 : largest < kSmall    ? ": small compared with what neither of them knows"
                 : largest < kLarge    ? ": not small compared with what neither of them knows"
                                    : ": more than the uncertainty that is left: here it matters");
}

/// `3 of 226 measurements were not used`
std::string RejectedText(const DecompositionStep& step) {
  const auto rejected = step.values.find("rejected"), all = step.values.find("measurements");
  if (rejected == step.values.end() || all == step.values.end()) return "";
  return internal::RoundedText(rejected->second.mean, 6) + " of " +
         internal::RoundedText(all->second.mean, 6) + " measurements were not used by the filter";
}

Section DecompositionSection(const Comparison& comparison, const DecompositionStep& step) {
  Section section;
  const std::string pair =
      step.from.empty() || step.to.empty() ? "" : ", " + step.from + " against " + step.to;
  section.title = ToString(step.kind);
  std::ranges::replace(section.title, '_', ' ');
  section.title += pair + (step.at_end ? ", at the last frame" : "");
  section.lines.push_back(WordsOf(step.kind));
  if (step.at_end) {
    section.lines.emplace_back("there the batch of all data is the full-information filter");
  }
  if (step.kind == DecompositionKind::kRejected) {
    section.lines.push_back(RejectedText(step) + (comparison.runs > 1 ? ", mean of the runs" : ""));
  }
  const auto rejected = step.values.find("rejected");
  if (rejected != step.values.end() && rejected->second.mean == 0.0) return section;
  if (!step.withheld.empty()) {
    section.lines.push_back("not known: " + step.withheld);
    return section;
  }
  std::map<std::string, std::string> units;
  for (const ComparedEstimator& one : comparison.estimators) {
    units.insert(one.units.begin(), one.units.end());
  }
  if (step.at_end) units["map"] = units["map.sim3"] = "m";
  const bool several = comparison.runs > 1;
  std::vector<Column> columns = {
      {step.from, Under(step.values, "rmse.from:", "rmse:"), units},
      {step.to, Under(step.values, "rmse.to:", "rmse:"), units},
      {"ratio", {}, {}},
      {step.at_end ? "difference" : "RMSD", Under(step.values, "rmsd:", "rmse:"), units}};
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
  if (const std::string line = LinesOf(step); !line.empty()) section.lines.push_back(line);
  return section;
}

/// All that estimators are compared with at the end.
std::string ReferencesText(const Comparison& comparison) {
  std::vector<std::string> names;
  for (const ComparedEstimator& one : comparison.estimators) {
    const std::string& name = one.final_reference;
    if (!name.empty() && std::ranges::count(names, name) == 0) names.push_back(name);
  }
  return names.empty() ? comparison.reference : internal::Join(names);
}

constexpr const char* kByBound = "mse_by_bound";

/// What ratios are, and their intervals, a line each.
std::vector<std::string> RatioLines(const Comparison& comparison) {
  bool to_reference = false, by_bound = false;
  for (const ComparedEstimator& one : comparison.estimators) {
    for (const auto& [key, ratio] : one.ratios) {
      const bool is_by_bound = key.starts_with(kByBound);
      by_bound = by_bound || is_by_bound;
      to_reference = to_reference || (!is_by_bound && ratio.error != ratio.reference_error);
    }
  }
  std::vector<std::string> lines;
  if (to_reference && comparison.runs == 1) {
    lines.emplace_back("ratios are of one run and have no interval: --runs N gives one");
  } else if (to_reference) {
    lines.push_back(
        "ratio: mean error over the runs by that of the reference [95 % interval, paired "
        "bootstrap over the runs]; undecided: the interval includes 1" +
        (comparison.runs < kFewRuns ? "; too few runs: of fewer than " + std::to_string(kFewRuns) +
                                          " it is too narrow, and decides nothing"
                                    : std::string()));
  }
  if (by_bound) {
    lines.emplace_back(
        "MSE / Cramer-Rao bound: mean square error by the least that an unbiased filter can have "
        "[95 % interval], mean over the run and the runs");
  }
  return lines;
}

std::vector<Section> SectionsOf(const Comparison& comparison, ReportRows rows) {
  std::vector<Section> sections;
  Section& head = sections.emplace_back();
  head.title = comparison.runs > 1 ? std::to_string(comparison.runs) + " runs, mean [5 %, 95 %]"
                                   : std::to_string(comparison.frames) + " frames";
  head.title += comparison.reference.empty() ? ""
                : comparison.reference == "truth"
                    ? ", errors against truth"
                    : ", differences from " + ReferencesText(comparison);
  head.lines = RatioLines(comparison);
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

/// Values, and ratios as `ratio.KEY`.
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

/// Numbers, null where there is none.
internal::Json JsonOf(const std::vector<double>& values) {
  internal::Json json = internal::Json::array();
  for (const double value : values) {
    json.push_back(std::isfinite(value) ? internal::Json(value) : internal::Json());
  }
  return json;
}

/// The average NEES by owner, timestamp by timestamp.
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

internal::Json JsonOf(const ComparedEstimator& one, bool several) {
  internal::Json json = {{"type", one.type},
                         {"smoothed", one.smoothed},
                         {"reference", one.reference},
                         {"final_reference", one.final_reference},
                         {"diverged", one.diverged},
                         {"used", one.used},
                         {"reference_runs", one.reference_runs},
                         {"final_reference_runs", one.final_reference_runs},
                         {"values", JsonOf(one.values, one.ratios, several)},
                         {"units", one.units}};
  if (several) json["anees"] = JsonOf(one.over_time);
  return json;
}

internal::Json JsonOfDecomposition(const Comparison& comparison) {
  internal::Json steps = internal::Json::array();
  for (const DecompositionStep& step : comparison.decomposition) {
    internal::Json json = {{"kind", ToString(step.kind)}, {"from", step.from}, {"to", step.to}};
    if (step.at_end) json["at_end"] = true;
    if (!step.withheld.empty()) json["withheld"] = step.withheld;
    json["values"] = JsonOf(step.values, step.ratios, comparison.runs > 1);
    steps.push_back(std::move(json));
  }
  return {{"filter", comparison.decomposed}, {"steps", std::move(steps)}};
}

}  // namespace

std::string CompareReport(const Comparison& comparison, TableStyle style, ReportRows rows) {
  std::vector<Section> sections = SectionsOf(comparison, rows);
  const auto count = [](const std::vector<Section>& all) {
    std::size_t sum = 0;
    for (const Section& one : all) sum += one.rows.size();
    return sum;
  };
  const std::size_t left_out = count(SectionsOf(comparison, ReportRows::kAll)) - count(sections);
  if (left_out > 0) {
    sections.push_back({std::to_string(left_out) + " more rows: --all", {}, {}, {}});
  }
  return internal::SectionsText(sections, style);
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
  for (const ComparedEstimator& one : comparison.estimators) {
    estimators[one.name] = JsonOf(one, comparison.runs > 1);
  }
  if (!comparison.decomposition.empty()) json["decomposition"] = JsonOfDecomposition(comparison);
  json["notes"] = comparison.notes;
  return internal::JsonText(json);
}

void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder,
                     bool force) {
  internal::OutputFolder out(folder, force);
  out.Write("compare.json", CompareJson(comparison));
  out.Write("compare.md", CompareReport(comparison, TableStyle::kMarkdown));
  out.Write("compare.tex", CompareReport(comparison, TableStyle::kLatex));
  out.Commit();
}

}  // namespace alidade
