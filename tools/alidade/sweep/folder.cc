// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>
#include <unordered_map>

#include "alidade/experiment/metric_rows.h"
#include "alidade/io/csv_file.h"
#include "alidade/io/json.h"
#include "alidade/io/output_folder.h"
#include "alidade/replay/run_inputs.h"
#include "alidade/report/page_text.h"
#include "alidade/sweep/conclusions.h"
#include "alidade/sweep/finished_runs.h"
#include "alidade/sweep/reprojection.h"
#include "alidade/sweep/run_record.h"
#include "alidade/sweep/sweep.h"
#include "alidade/sweep/table.h"
#include "alidade/sweep/vary_files.h"

namespace alidade {

using internal::ConclusionsJson;
using internal::ConclusionsOf;
using internal::CountFinished;
using internal::CountWithheld;
using internal::CsvFile;
using internal::Json;
using internal::OutputFolder;

namespace fs = std::filesystem;

namespace {

/// Result of a sweep, and the value of the varied key. The value is "" if no key is varied.
struct Part {
  const SweepResult* result;
  std::string value;
};
using Parts = std::vector<Part>;

Parts PartsOf(const VariedSweep& sweep) {
  Parts parts;
  for (const SweepResult& result : sweep.results) {
    parts.push_back({&result, sweep.variation.values[parts.size()]});
  }
  return parts;
}

Json EstimatorsOf(const std::vector<SweepSummary>& summaries) {
  Json json = Json::object();
  for (const SweepSummary& summary : summaries) {
    Json& entry = json[summary.name];
    entry["used"] = summary.used;
    Json& verdicts = entry["verdicts"] = Json::object();
    for (const VerdictInfo& verdict : kVerdicts) {
      verdicts[verdict.name] = summary.CountOf(verdict.state);
    }
    Json& metrics = entry["metrics"] = Json::object();
    for (const auto& [key, spread] : summary.metrics) {
      const Interval& interval = summary.mean_intervals.at(key);
      metrics[key] = {{"mean", spread.mean},        {"mean_low", interval.low},
                      {"mean_high", interval.high}, {"p05", spread.p05},
                      {"p50", spread.p50},          {"p95", spread.p95}};
    }
    Json& nees = entry["bounds"] = Json::object();
    for (const auto& [key, bounds] : internal::NeesBounds(summary)) {
      nees[key] = {{"low", bounds.low}, {"high", bounds.high}};
    }
    entry["units"] = summary.units;
  }
  return json;
}

const char* StatusOf(bool stopped) {
  return ToString(stopped ? RunStatus::kStopped : RunStatus::kOk);
}

std::string SweepJson(const SweepResult& result, const std::vector<SweepSummary>& summaries) {
  return internal::JsonText({{"status", StatusOf(result.stopped)},
                             {"runs", result.runs},
                             {"runs_used", CountFinished(result)},
                             {"first_seed", result.first_seed},
                             {"reference", result.reference},
                             {"withheld", CountWithheld(result)},
                             {"conclusions", ConclusionsJson(ConclusionsOf(result, summaries))},
                             {"estimators", EstimatorsOf(summaries)}});
}

std::string SweepJson(const VariedSweep& sweep) {
  Json values = Json::array();
  for (const Part& part : PartsOf(sweep)) {
    values.push_back({{"value", part.value},
                      {"runs_used", CountFinished(*part.result)},
                      {"reference", part.result->reference},
                      {"withheld", CountWithheld(*part.result)},
                      {"estimators", EstimatorsOf(Summarise(*part.result))}});
  }
  return internal::JsonText(
      {{"status", StatusOf(sweep.stopped())},
       {"runs", sweep.results.front().runs},
       {"first_seed", sweep.results.front().first_seed},
       {"vary", sweep.variation.key},
       {"scope", sweep.variation.scope == Variation::Scope::kConfig ? "config" : "estimators"},
       {"warning", sweep.warning},
       {"conclusions", ConclusionsJson(ConclusionsOf(sweep))},
       {"values", std::move(values)}});
}

/// Returns a result that contains the keys of all metrics and counts of all runs. OrderedMetrics()
/// sorts these keys.
RunResult AllKeys(const Parts& parts) {
  RunResult result;
  EstimatorResult& keys = result.estimators.emplace_back();
  std::set<const void*> visited_lists;  // addresses of lists of names
  const auto add = [&visited_lists](const auto& row, auto& map) {
    if (!visited_lists.insert(&row.names()).second) return;
    for (const std::string& name : row.names()) map[name];
  };
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) {
      for (const SweepRow& row : run.estimators) {
        add(row.metrics, keys.metrics);
        add(row.counts, keys.counts);
      }
    }
  }
  return result;
}

/// Returns `header`. If a key is varied, the key is inserted as the first column.
std::vector<std::string> Header(const std::string& key, std::vector<std::string> header) {
  if (!key.empty()) header.insert(header.begin(), key);
  return header;
}

/// Columns of a table. The names of a row may have another order than the columns.
template <class Value>
class Columns {
 public:
  explicit Columns(std::vector<std::string> names) : names_(std::move(names)) {
    for (std::size_t i = 0; i < names_.size(); ++i) columns_[names_[i]] = i;
  }
  const std::vector<std::string>& names() const { return names_; }
  /// Returns the values of a row in the order of the columns. A pointer is null if the row has no
  /// value in that column.
  const std::vector<const Value*>& Arrange(const NamedValues<Value>& row) {
    std::vector<std::size_t>& columns = columns_of_list_[&row.names()];
    if (columns.empty()) {
      for (const std::string& name : row.names()) columns.push_back(columns_.at(name));
    }
    cells_.assign(names_.size(), nullptr);
    for (std::size_t i = 0; i < columns.size(); ++i) cells_[columns[i]] = &row.values()[i];
    return cells_;
  }

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> columns_;  ///< index of each column, by name
  /// Column of each name in a list of names. The key is the address of the list.
  std::unordered_map<const void*, std::vector<std::size_t>> columns_of_list_;
  std::vector<const Value*> cells_;
};

void WriteRuns(const OutputFolder& folder, const Parts& parts, const std::string& key) {
  const RunResult keys = AllKeys(parts);
  Columns<double> metrics(internal::OrderedMetrics(keys));
  Columns<std::int64_t> counts(internal::OrderedCounts(keys));
  std::vector<std::string> header = Header(key, {"seed", "estimator", "verdict"});
  header.insert(header.end(), metrics.names().begin(), metrics.names().end());
  header.insert(header.end(), counts.names().begin(), counts.names().end());
  CsvFile csv(folder, "runs.csv", header);
  const auto write_run = [&](const Part& part, const SweepRun& run, const SweepRow& row) {
    if (!key.empty()) csv.Text(part.value);
    csv.Integer(static_cast<std::int64_t>(run.seed)).Text(row.name);
    csv.Text(ToString(row.verdict));
    for (const double* const value : metrics.Arrange(row.metrics)) {
      value == nullptr ? csv.Empty() : csv.Number(*value);
    }
    for (const std::int64_t* const count : counts.Arrange(row.counts)) {
      csv.Integer(count == nullptr ? 0 : *count);
    }
    csv.EndRow();
  };
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) {
      for (const SweepRow& row : run.estimators) {
        if (run.UsesMetricsOf(row) || row.diverged) write_run(part, run, row);
      }
    }
  }
  csv.Close();
}

void WriteFailures(const OutputFolder& folder, const Parts& parts, const std::string& key) {
  const auto failed = [](const SweepRun& run) { return run.status == RunStatus::kFailed; };
  const auto has_failed_run = [&](const Part& part) {
    return std::ranges::any_of(part.result->done, failed);
  };
  if (std::ranges::none_of(parts, has_failed_run)) return;
  CsvFile csv(folder, "failures.csv", Header(key, {"seed", "exit_code", "reason"}));
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) {
      if (!failed(run)) continue;
      if (!key.empty()) csv.Text(part.value);
      csv.Integer(static_cast<std::int64_t>(run.seed)).Integer(static_cast<int>(run.code));
      csv.Text(run.reason).EndRow();
    }
  }
  csv.Close();
}

/// Replaces the file of finished runs by a file with all runs, sorted by value and seed.
void WriteShardRuns(const OutputFolder& folder, const Parts& parts) {
  const std::string sorted = std::string(internal::kFinishedRuns) + ".sorted";
  const auto file = folder.Create(sorted);
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) file->Write(internal::RunLine(part.value, run));
  }
  file->Close();
  std::error_code error;
  fs::rename(folder.partial() / sorted, folder.partial() / internal::kFinishedRuns, error);
  if (error) internal::FailIo((folder.partial() / sorted).string(), "rename", error.value());
}

/// Refuses to continue a sweep whose config or inputs differ from `current`.
void CheckInputs(const fs::path& partial, const internal::InputTexts& current) {
  const std::string difference = internal::DescribeDifferences(
      internal::ReadInputTexts(partial), (partial / internal::kInputsFile).string(), current);
  if (difference.empty()) return;
  throw Error(ExitCode::kCannotCreate,
              ErrorLine(Place{partial.string()}, {},
                        "the folder was made from other inputs: " + difference) +
                  "; to start a new sweep, remove the folder, or use --force without --resume");
}

/// Removes the result files that a stopped sweep has written.
void RemoveResults(const OutputFolder& folder) {
  const std::set<std::string> permanent = {internal::kResolvedConfig, internal::kInputsFile,
                                           internal::kFinishedRuns, "files.txt"};
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.partial())) {
    names.insert(entry.path().filename().string());
  }
  for (const std::string& name : names) {
    if (!permanent.contains(name)) folder.Remove(name);
  }
}

}  // namespace

struct SweepFolder::Impl {
  Impl(const Options& options, const Config& config);
  Impl(const fs::path& path, bool force) : folder(path, force) {}
  /// Completes the folder at the end of Write().
  void Complete(const Parts& parts, bool stopped, const Config& config);

  OutputFolder folder;
  bool shard = false;
  std::optional<internal::FinishedRuns> finished;
};

SweepFolder::Impl::Impl(const Options& options, const Config& config)
    : folder(options.folder, options.force, options.resume), shard(options.shard) {
  const std::string text = config.ToYaml();
  if (fs::exists(folder.partial() / internal::kInputsFile)) {
    CheckInputs(folder.partial(), {text, options.inputs});
    RemoveResults(folder);
  } else {
    folder.Write(internal::kResolvedConfig, text);
    folder.Write(internal::kInputsFile, options.inputs);
  }
  folder.Write("sweep.json", internal::JsonText({{"status", "running"}}));
  finished.emplace(folder);
}

SweepFolder::SweepFolder(const fs::path& folder, bool force)
    : impl_(std::make_unique<Impl>(folder, force)) {}

SweepFolder::SweepFolder(const Options& options, const Config& config)
    : impl_(std::make_unique<Impl>(options, config)) {}

SweepFolder::~SweepFolder() = default;

internal::FinishedRuns* SweepFolder::finished() {
  return impl_->finished ? &*impl_->finished : nullptr;
}

const internal::OutputFolder& SweepFolder::files() const { return impl_->folder; }

void SweepFolder::AddFile(const std::string& name, const std::string& text) {
  impl_->folder.Write(name, text);
}

void SweepFolder::Impl::Complete(const Parts& parts, bool stopped, const Config& config) {
  if (finished) {
    finished->Close();
    if (stopped) return internal::WritePage(folder);
    if (shard) {
      WriteShardRuns(folder, parts);
    } else {
      folder.Remove(internal::kFinishedRuns);
    }
  } else {
    folder.Write(internal::kResolvedConfig, config.ToYaml());
  }
  internal::CommitWithPage(folder);
}

void SweepFolder::Write(const SweepResult& result, const std::vector<SweepSummary>& summaries,
                        const Config& config) {
  impl_->folder.Retain();
  const OutputFolder& folder = impl_->folder;
  folder.Write("sweep.json", SweepJson(result, summaries));
  const Parts parts = {{&result, ""}};
  WriteRuns(folder, parts, "");
  WriteFailures(folder, parts, "");
  folder.Write("table.md", internal::SweepMarkdown(result, summaries));
  impl_->Complete(parts, result.stopped, config);
}

void SweepFolder::Write(const VariedSweep& sweep, const Config& config) {
  impl_->folder.Retain();
  const OutputFolder& folder = impl_->folder;
  const Parts parts = PartsOf(sweep);
  folder.Write("sweep.json", SweepJson(sweep));
  internal::WriteSweepCsv(folder, sweep);
  WriteRuns(folder, parts, sweep.variation.key);
  WriteFailures(folder, parts, sweep.variation.key);
  folder.Write("table.md", internal::VariedMarkdown(sweep));
  internal::WriteReprojection(folder, sweep);
  impl_->Complete(parts, sweep.stopped(), config);
}

}  // namespace alidade
