// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/vary_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "alidade/base/number_text.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/figure_script.h"
#include "alidade/record/figures.h"
#include "alidade/sweep/table.h"
#include "alidade/sweep/value_labels.h"

namespace alidade {
namespace internal {
namespace {

constexpr std::array<std::pair<const char*, double Spread::*>, 4> kSpread = {
    {{"mean", &Spread::mean}, {"p05", &Spread::p05}, {"p50", &Spread::p50}, {"p95", &Spread::p95}}};

/// One estimator at each value.
using Column = std::vector<SweepSummary>;

/// By estimator, then by value.
std::vector<Column> ColumnsOf(const VariedSweep& sweep) {
  std::vector<Column> columns(sweep.results.front().estimators.size());
  for (const SweepResult& result : sweep.results) {
    std::vector<SweepSummary> summaries = Summarise(result);
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i].push_back(std::move(summaries[i]));
  }
  return columns;
}

/// The means as a comparison, a column for each value, whose numbers then share unit and decimals.
RunResult AsComparison(const Column& column) {
  RunResult comparison;
  for (const SweepSummary& summary : column) {
    EstimatorResult& one = comparison.estimators.emplace_back();
    one.units = summary.units;
    for (const auto& [key, spread] : summary.metrics) one.metrics[key] = spread.mean;
  }
  return comparison;
}

/// One estimator as a table: a row for each value.
struct ValueTable {
  std::vector<std::string> header;  ///< without the label's
  std::vector<TableRow> rows;
};

ValueTable TableOf(const VariedSweep& sweep, const Column& column) {
  ValueTable table;
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    table.rows.push_back({sweep.variation.values[v], {}});
  }
  const auto add_columns = [&](const std::vector<TableRow>& columns) {
    for (const TableRow& source : columns) {
      table.header.push_back(source.label);
      for (std::size_t v = 0; v < table.rows.size(); ++v) {
        table.rows[v].cells.push_back(source.cells[v]);
      }
    }
  };
  add_columns(VerdictRows(column));
  add_columns(MetricRows(AsComparison(column)));
  return table;
}

/// The values as numbers, where all of them are.
std::optional<std::vector<double>> NumbersOf(const std::vector<std::string>& values) {
  std::vector<double> numbers;
  for (const std::string& value : values) {
    const char* const end = value.data() + value.size();
    const auto [rest, error] = std::from_chars(value.data(), end, numbers.emplace_back());
    if (error != std::errc() || rest != end || !std::isfinite(numbers.back())) return {};
  }
  return numbers;
}

/// Whether positive numbers lie too far apart for a linear axis.
bool WantsLogAxis(const std::vector<double>& numbers) {
  constexpr double kFar = 50.0;
  const auto [low, high] = std::ranges::minmax_element(numbers);
  return low != numbers.end() && *low > 0.0 && *high > kFar * *low;
}

std::string ColumnNamed(const std::string& name) { return "column(" + GnuplotQuoted(name) + ')'; }

/// Settings of the axis of values, and the expression for it.
std::string SetAxis(FigureScript& script, const VariedSweep& sweep) {
  const std::vector<std::string>& values = sweep.variation.values;
  if (const auto numbers = NumbersOf(values)) {
    // One range for all panels, also where some values have no metrics.
    const auto [low, high] = std::ranges::minmax(*numbers);
    const bool log = WantsLogAxis(*numbers);
    const double margin = 0.02 * (high - low);
    if (log) script.Set("set logscale x\nset format x '%g'");
    if (high > low) {
      script.Set("set xrange [" + NumberText(log ? low / 1.5 : low - margin) + ':' +
                 NumberText(log ? high * 1.5 : high + margin) + ']');
    }
    return '(' + ColumnNamed(sweep.variation.key) + ')';
  }
  const std::vector<std::string> labels = ValueLabels(values);
  std::string tics;
  for (std::size_t v = 0; v < values.size(); ++v) {
    tics += (v > 0 ? ", " : "") + GnuplotQuoted(labels[v]) + ' ' + std::to_string(v);
  }
  script.Set("set xtics (" + tics + ")\nset xrange [-0.5:" + std::to_string(values.size()) +
             " - 0.5]");
  return "($0)";
}

/// Whether a metric is an error with a unit: of a block, or of a map.
bool IsError(const std::string& key) { return key.starts_with("rmse:") || key == "map.rmse"; }

/// The panel of one metric; none where it is the same everywhere, as of what is held at truth.
void MetricPanel(FigureScript& script, const std::vector<Column>& columns, const std::string& key,
                 const std::string& x, std::int64_t rows) {
  std::vector<double> drawn;
  std::string unit = key.starts_with("lag_ms") ? "ms" : key == "map.rmse" ? "m" : "";
  for (const Column& column : columns) {
    for (const SweepSummary& summary : column) {
      const auto found = summary.metrics.find(key);
      if (found == summary.metrics.end() || !std::isfinite(found->second.mean)) continue;
      for (const auto& [name, member] : kSpread) drawn.push_back(found->second.*member);
      const auto known = summary.units.find(key.substr(key.find(':') + 1));
      if (known != summary.units.end() && key.starts_with("rmse")) unit = known->second;
    }
  }
  if (std::ranges::adjacent_find(drawn, std::not_equal_to()) == drawn.end()) return;
  std::string title = key;
  std::ranges::replace(title, ':', ' ');
  script.Panel(title + ": mean, 5 % to 95 %", InBrackets(unit));
  script.Set(IsError(key) && WantsLogAxis(drawn) ? "set logscale y" : "unset logscale y");
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string& name = columns[i].front().name;
    std::string how = x;
    for (const char* part : {".mean:", ".p05:", ".p95:"}) {
      how.append(":(").append(ColumnNamed(name + part + key)).append(")");
    }
    const std::string style = " with yerrorlines ls " + std::to_string(i % 8 + 1) + " pt 7 ps 0.5";
    script.Curve({"sweep.csv", rows, 1}, how + style, name);
  }
}

FigureScript VariationFigure(const VariedSweep& sweep) {
  FigureScript script("vary", "what " + sweep.variation.key + " does", sweep.variation.key);
  const std::vector<Column> columns = ColumnsOf(sweep);
  const auto rows = static_cast<std::int64_t>(sweep.results.size());
  RunResult all;
  for (const Column& column : columns) {
    const RunResult some = AsComparison(column);
    all.estimators.insert(all.estimators.end(), some.estimators.begin(), some.estimators.end());
  }
  const std::string x = SetAxis(script, sweep);
  for (const std::string& key : OrderedMetrics(all)) {
    const bool shown =
        IsError(key) || key.starts_with("lag_ms:") || key.starts_with("nees.within95:");
    if (shown && key.find('@') == key.npos) MetricPanel(script, columns, key, x, rows);
  }
  script.Panel("runs that diverged or were lost", "");
  script.Set("unset logscale y\nset yrange [0:]");
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string& name = columns[i].front().name;
    script.Curve({"sweep.csv", rows, 1},
                 x + ":(" + ColumnNamed(name + ".diverged") + " + " + ColumnNamed(name + ".lost") +
                     ") with linespoints ls " + std::to_string(i % 8 + 1) + " pt 7 ps 0.5",
                 name);
  }
  return script;
}

}  // namespace

void WriteSweepCsv(const OutputFolder& folder, const VariedSweep& sweep) {
  const std::vector<Column> columns = ColumnsOf(sweep);
  std::vector<std::string> header = {sweep.variation.key};
  std::vector<std::vector<std::string>> keys;
  for (const Column& column : columns) {
    const std::string& name = column.front().name;
    header.insert(header.end(), {name + ".used", name + ".diverged", name + ".lost"});
    RunResult comparison = AsComparison(column);
    for (const std::string& key : keys.emplace_back(OrderedMetrics(comparison))) {
      for (const auto& [part, member] : kSpread) header.push_back(name + '.' + part + ':' + key);
    }
  }
  CsvFile csv(folder, "sweep.csv", header);
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    csv.Text(sweep.variation.values[v]);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const SweepSummary& summary = columns[i][v];
      csv.Integer(summary.used)
          .Integer(summary.diverged)
          .Integer(summary.CountOf(VerdictState::kLost));
      for (const std::string& key : keys[i]) {
        const auto found = summary.metrics.find(key);
        for (const auto& [part, member] : kSpread) {
          found == summary.metrics.end() ? csv.Empty() : csv.Number(found->second.*member);
        }
      }
    }
    csv.EndRow();
  }
  csv.Close();
}

std::string VariedMarkdown(const VariedSweep& sweep) {
  const SweepResult& first = sweep.results.front();
  std::string text =
      "Seeds " + std::to_string(first.first_seed) + " to " +
      std::to_string(first.first_seed + static_cast<std::uint64_t>(first.runs) - 1) +
      " for each value" +
      (sweep.variation.scope == Variation::Scope::kEstimators ? ", for the estimators only" : "") +
      ". Means over the runs that did not diverge.\n";
  if (!sweep.warning.empty()) text += "\nWarning: " + sweep.warning + ".\n";
  for (const Column& column : ColumnsOf(sweep)) {
    const ValueTable table = TableOf(sweep, column);
    const std::string corner = '`' + column.front().name + "`: " + sweep.variation.key;
    text += '\n' + FormatTable(MakeTable(table.header, table.rows, corner), TableFormat::kMarkdown);
  }
  return text + ReferenceLines(sweep);
}

std::string DrawVariation(const OutputFolder& folder, const VariedSweep& sweep,
                          const std::function<bool()>& stop) {
  if (sweep.stopped()) return "the sweep was stopped";
  const FigureScript script = VariationFigure(sweep);
  folder.Write("figures/vary.gp", script.Text());
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  const GnuplotResult result =
      DrawFigure(folder, "vary.svg", {"figures/vary.gp"}, DrawingLimits{stop, end});
  if (result.end == GnuplotResult::End::kFailed) return result.complaint;
  return Obstacle(result.end);
}

}  // namespace internal

std::string SweepTable(const VariedSweep& sweep) {
  std::string text;
  for (const internal::Column& column : internal::ColumnsOf(sweep)) {
    const internal::ValueTable table = internal::TableOf(sweep, column);
    if (!text.empty()) text += '\n';
    text +=
        column.front().name + ", means by " + sweep.variation.key + '\n' +
        FormatTable(internal::MakeTable(table.header, table.rows), internal::TableFormat::kText);
  }
  return text + internal::ReferenceLines(sweep);
}

}  // namespace alidade
