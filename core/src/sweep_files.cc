// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/sweep.h"
#include "comparison_table.h"
#include "csv_file.h"
#include "json.h"
#include "names.h"
#include "run_folder.h"
#include "text_table.h"

namespace alidade {

using internal::ComparisonRow;
using internal::CsvFile;
using internal::Join;
using internal::Json;
using internal::NamesOf;
using internal::RunFolder;

struct SweepFolder::Impl {
  Impl(const std::filesystem::path& path, bool force) : folder(path, force) {}
  RunFolder folder;
};

namespace {

/// Runs that came to their end.
std::int64_t CountWhole(const SweepResult& result) {
  return std::ranges::count(result.done, RunStatus::kOk, &SweepRun::status);
}

/// ReferenceText of each run that has a reference, as a line of its own behind an empty one.
std::string ReferenceLine(const SweepResult& result) {
  RunResult of_runs;
  of_runs.reference = result.reference;
  const std::string text = internal::ReferenceText(of_runs);
  return text.empty() ? "" : '\n' + text + '\n';
}

/// A cell for each estimator. Each one stands as four in a comparison, so that its numbers share
/// their unit and decimals with all others of the row.
std::vector<ComparisonRow> TableRows(const std::vector<SweepSummary>& summaries) {
  RunResult columns;
  for (const SweepSummary& summary : summaries) {
    for (const auto member : {&Spread::mean, &Spread::p05, &Spread::p50, &Spread::p95}) {
      EstimatorResult& column = columns.estimators.emplace_back();
      column.units = summary.units;
      for (const auto& [key, spread] : summary.metrics) column.metrics[key] = spread.*member;
    }
  }
  std::vector<ComparisonRow> rows;
  for (const ComparisonRow& from : internal::MetricRows(columns)) {
    ComparisonRow& row = rows.emplace_back(ComparisonRow{from.label, {}});
    for (std::size_t i = 0; i < from.cells.size(); i += 4) {
      const std::string* const c = &from.cells[i];
      row.cells.push_back(c[0] == "-" ? "-" : c[0] + " [" + c[1] + ", " + c[2] + ", " + c[3] + ']');
    }
  }
  ComparisonRow used{"runs used", {}}, diverged{"diverged", {}};
  for (const SweepSummary& summary : summaries) {
    used.cells.push_back(std::to_string(summary.used));
    diverged.cells.push_back(std::to_string(summary.diverged));
  }
  rows.push_back(used);
  rows.push_back(diverged);
  return rows;
}

std::string Markdown(const SweepResult& result) {
  std::string text = std::to_string(CountWhole(result)) + " of " + std::to_string(result.runs) +
                     " runs, seeds from " + std::to_string(result.first_seed) +
                     ". Mean [5 %, 50 %, 95 % quantile] over the runs that did not diverge.\n\n";
  const std::vector<SweepSummary> summaries = Summarise(result);
  text += "|  | " + Join(NamesOf(summaries), " | ") + " |\n|---|";
  for (std::size_t c = 0; c < summaries.size(); ++c) text += "---:|";
  text += '\n';
  for (const ComparisonRow& row : TableRows(summaries)) {
    text += "| " + row.label + " | " + Join(row.cells, " | ") + " |\n";
  }
  return text + ReferenceLine(result);
}

std::string SweepJson(const SweepResult& result) {
  Json json;
  json.Object();
  json.Key("runs").Integer(result.runs);
  json.Key("runs_used").Integer(CountWhole(result));
  json.Key("first_seed").Integer(static_cast<std::int64_t>(result.first_seed));
  json.Key("reference").Text(result.reference);
  json.Key("estimators").Object();
  for (const SweepSummary& summary : Summarise(result)) {
    json.Key(summary.name).Object();
    json.Key("diverged").Integer(summary.diverged);
    json.Key("metrics").Object();
    for (const auto& [key, spread] : summary.metrics) {
      json.Key(key).Object();
      json.Key("mean").Number(spread.mean);
      json.Key("p05").Number(spread.p05);
      json.Key("p50").Number(spread.p50);
      json.Key("p95").Number(spread.p95);
      json.End();
    }
    json.End();
    json.End();
  }
  json.End();
  json.End();
  return json.text();
}

/// Keys that any run has, in the order of a comparison.
RunResult AllKeys(const SweepResult& result) {
  RunResult all;
  EstimatorResult& keys = all.estimators.emplace_back();
  for (const SweepRun& run : result.done) {
    for (const EstimatorResult& one : run.estimators) {
      keys.metrics.insert(one.metrics.begin(), one.metrics.end());
      keys.counts.insert(one.counts.begin(), one.counts.end());
    }
  }
  return all;
}

void WriteRuns(const RunFolder& folder, const SweepResult& result) {
  const RunResult all = AllKeys(result);
  const std::vector<std::string> metrics = internal::OrderedMetrics(all);
  const std::vector<std::string> counts = internal::OrderedCounts(all);
  std::vector<std::string> header = {"seed", "estimator", "diverged"};
  header.insert(header.end(), metrics.begin(), metrics.end());
  header.insert(header.end(), counts.begin(), counts.end());
  CsvFile csv(folder, "runs.csv", header);
  for (const SweepRun& run : result.done) {
    for (const EstimatorResult& one : run.estimators) {
      if (!run.Uses(one) && !one.diverged) continue;
      csv.Integer(static_cast<std::int64_t>(run.seed)).Text(one.name);
      csv.Text(one.diverged ? "true" : "false");
      for (const std::string& key : metrics) {
        const auto found = one.metrics.find(key);
        found == one.metrics.end() ? csv.Empty() : csv.Number(found->second);
      }
      for (const std::string& key : counts) {
        const auto found = one.counts.find(key);
        csv.Integer(found == one.counts.end() ? 0 : found->second);
      }
      csv.EndRow();
    }
  }
  csv.Close();
}

void WriteFailures(const RunFolder& folder, const SweepResult& result) {
  const auto failed = [](const SweepRun& run) { return run.status == RunStatus::kFailed; };
  if (std::none_of(result.done.begin(), result.done.end(), failed)) return;
  CsvFile csv(folder, "failures.csv", {"seed", "exit_code", "reason"});
  for (const SweepRun& run : result.done) {
    if (!failed(run)) continue;
    csv.Integer(static_cast<std::int64_t>(run.seed)).Integer(static_cast<int>(run.code));
    csv.Text(run.reason).EndRow();
  }
  csv.Close();
}

}  // namespace

std::string SweepTable(const SweepResult& result) {
  const std::vector<SweepSummary> summaries = Summarise(result);
  return internal::EstimatorTable(NamesOf(summaries), TableRows(summaries)) + ReferenceLine(result);
}

SweepFolder::SweepFolder(const std::filesystem::path& folder, bool force)
    : impl_(std::make_unique<Impl>(folder, force)) {}

SweepFolder::~SweepFolder() = default;

void SweepFolder::Write(const SweepResult& result, const Config& config) {
  const RunFolder& folder = impl_->folder;
  folder.Write("config.resolved.yaml", config.ToYaml());
  folder.Write("sweep.json", SweepJson(result));
  WriteRuns(folder, result);
  WriteFailures(folder, result);
  folder.Write("table.md", Markdown(result));
  impl_->folder.Commit();
}

}  // namespace alidade
