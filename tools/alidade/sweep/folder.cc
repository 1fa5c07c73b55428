// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <unordered_map>

#include "alidade/base/csv_file.h"
#include "alidade/base/json.h"
#include "alidade/base/output_folder.h"
#include "alidade/resume/leftovers.h"
#include "alidade/resume/run_inputs.h"
#include "alidade/run/metric_rows.h"
#include "alidade/sweep/finished_runs.h"
#include "alidade/sweep/reprojection.h"
#include "alidade/sweep/run_line.h"
#include "alidade/sweep/shards.h"
#include "alidade/sweep/sweep.h"
#include "alidade/sweep/table.h"
#include "alidade/sweep/vary_files.h"

namespace alidade {

using internal::CountWhole;
using internal::CountWithheld;
using internal::CsvFile;
using internal::Json;
using internal::OutputFolder;

struct SweepFolder::Impl {
  Impl(const Options& options, const Config& config);
  Impl(const std::filesystem::path& path, bool force) : folder(path, force) {}
  /// Unless it is there already.
  void WriteConfig(const Config& config) const;
  void Commit(bool stopped);

  OutputFolder folder;
  bool shard = false;
  std::optional<internal::Leftovers> leftovers;
  std::optional<internal::FinishedRuns> finished;
};

SweepFolder::Impl::Impl(const Options& options, const Config& config)
    : folder(options.folder, options.force || options.resume), shard(options.shard) {
  std::vector<std::filesystem::path> before;
  if (options.resume) {
    if (!options.force) internal::CheckReplaceable(options.folder);
    leftovers.emplace(options.folder).CheckInputs(config.ToYaml(), options.inputs);
    before = leftovers->folders();
  }
  if (options.inputs.empty()) return;
  folder.Write(internal::kResolvedConfig, config.ToYaml());
  folder.Write(internal::kInputsFile, options.inputs);
  finished.emplace(folder, before);
}

void SweepFolder::Impl::WriteConfig(const Config& config) const {
  if (!finished) folder.Write(internal::kResolvedConfig, config.ToYaml());
}

void SweepFolder::Impl::Commit(bool stopped) {
  if (finished) finished->Close();
  folder.Commit(finished && !stopped ? internal::kFinishedRuns : "");
  if (leftovers) leftovers->Remove();
}

namespace {

/// A sweep, and the value of the varied key that it is of, "" where none is varied.
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
    Json& one = json[summary.name];
    one = {{"diverged", summary.diverged}, {"inconsistent", summary.inconsistent}};
    Json& metrics = one["metrics"] = Json::object();
    for (const auto& [key, spread] : summary.metrics) {
      metrics[key] = {
          {"mean", spread.mean}, {"p05", spread.p05}, {"p50", spread.p50}, {"p95", spread.p95}};
    }
    Json& nees = one["bounds"] = Json::object();
    for (const auto& [key, bounds] : internal::NeesBounds(summary)) {
      nees[key] = {{"low", bounds.low}, {"high", bounds.high}};
    }
  }
  return json;
}

const char* StatusOf(bool stopped) {
  return ToString(stopped ? RunStatus::kStopped : RunStatus::kOk);
}

std::string SweepJson(const SweepResult& result, const std::vector<SweepSummary>& summaries) {
  return internal::JsonText({{"status", StatusOf(result.stopped)},
                             {"runs", result.runs},
                             {"runs_used", CountWhole(result)},
                             {"first_seed", result.first_seed},
                             {"reference", result.reference},
                             {"withheld", CountWithheld(result)},
                             {"estimators", EstimatorsOf(summaries)}});
}

std::string SweepJson(const VariedSweep& sweep) {
  Json values = Json::array();
  for (const Part& part : PartsOf(sweep)) {
    values.push_back({{"value", part.value},
                      {"runs_used", CountWhole(*part.result)},
                      {"reference", part.result->reference},
                      {"withheld", CountWithheld(*part.result)},
                      {"estimators", EstimatorsOf(Summarise(*part.result))}});
  }
  return internal::JsonText({{"status", StatusOf(sweep.stopped())},
                             {"runs", sweep.results.front().runs},
                             {"first_seed", sweep.results.front().first_seed},
                             {"vary", sweep.variation.key},
                             {"values", std::move(values)}});
}

/// Keys that any run has, in the order of a comparison.
RunResult AllKeys(const Parts& parts) {
  RunResult all;
  EstimatorResult& keys = all.estimators.emplace_back();
  std::set<const void*> seen;  // lists of names
  const auto add = [&seen](const auto& row, auto& to) {
    if (!seen.insert(&row.names()).second) return;
    for (const std::string& name : row.names()) to[name];
  };
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) {
      for (const SweepEstimator& one : run.estimators) {
        add(one.metrics, keys.metrics);
        add(one.counts, keys.counts);
      }
    }
  }
  return all;
}

/// `header`, below the varied key where there is one.
std::vector<std::string> Header(const std::string& key, std::vector<std::string> header) {
  if (!key.empty()) header.insert(header.begin(), key);
  return header;
}

/// Columns of a table, which go by names of their own order.
template <class Value>
class Columns {
 public:
  explicit Columns(std::vector<std::string> names) : names_(std::move(names)) {
    for (std::size_t i = 0; i < names_.size(); ++i) columns_[names_[i]] = i;
  }
  const std::vector<std::string>& names() const { return names_; }
  /// The cells of a row with those values, none of other names; null: it has none.
  const std::vector<const Value*>& Of(const NamedValues<Value>& row) {
    std::vector<std::size_t>& places = places_[&row.names()];
    if (places.empty()) {
      for (const std::string& name : row.names()) places.push_back(columns_.at(name));
    }
    cells_.assign(names_.size(), nullptr);
    for (std::size_t i = 0; i < places.size(); ++i) cells_[places[i]] = &row.values()[i];
    return cells_;
  }

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> columns_;  ///< by name
  /// By list of names: the columns of its values.
  std::unordered_map<const void*, std::vector<std::size_t>> places_;
  std::vector<const Value*> cells_;
};

void WriteRuns(const OutputFolder& folder, const Parts& parts, const std::string& key) {
  const RunResult all = AllKeys(parts);
  Columns<double> metrics(internal::OrderedMetrics(all));
  Columns<std::int64_t> counts(internal::OrderedCounts(all));
  std::vector<std::string> header = Header(key, {"seed", "estimator", "diverged", "inconsistent"});
  header.insert(header.end(), metrics.names().begin(), metrics.names().end());
  header.insert(header.end(), counts.names().begin(), counts.names().end());
  CsvFile csv(folder, "runs.csv", header);
  const auto write_run = [&](const Part& part, const SweepRun& run, const SweepEstimator& one) {
    if (!key.empty()) csv.Text(part.value);
    csv.Integer(static_cast<std::int64_t>(run.seed)).Text(one.name);
    csv.Text(one.diverged ? "true" : "false").Text(one.inconsistent ? "true" : "false");
    for (const double* const value : metrics.Of(one.metrics)) {
      value == nullptr ? csv.Empty() : csv.Number(*value);
    }
    for (const std::int64_t* const count : counts.Of(one.counts)) {
      csv.Integer(count == nullptr ? 0 : *count);
    }
    csv.EndRow();
  };
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) {
      for (const SweepEstimator& one : run.estimators) {
        if (run.Uses(one) || one.diverged) write_run(part, run, one);
      }
    }
  }
  csv.Close();
}

void WriteFailures(const OutputFolder& folder, const Parts& parts, const std::string& key) {
  const auto failed = [](const SweepRun& run) { return run.status == RunStatus::kFailed; };
  const auto any = [&](const Part& part) { return std::ranges::any_of(part.result->done, failed); };
  if (std::ranges::none_of(parts, any)) return;
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

/// All runs of a shard, by value and seed, for MergeShards().
void WriteShardRuns(const OutputFolder& folder, const Parts& parts) {
  const auto file = folder.Create(internal::kShardRuns);
  for (const Part& part : parts) {
    for (const SweepRun& run : part.result->done) file->Write(internal::RunLine(part.value, run));
  }
  file->Close();
}

}  // namespace

SweepFolder::SweepFolder(const std::filesystem::path& folder, bool force)
    : impl_(std::make_unique<Impl>(folder, force)) {}

SweepFolder::SweepFolder(const Options& options, const Config& config)
    : impl_(std::make_unique<Impl>(options, config)) {}

SweepFolder::~SweepFolder() = default;

internal::FinishedRuns* SweepFolder::finished() {
  return impl_->finished ? &*impl_->finished : nullptr;
}

const std::vector<std::filesystem::path>& SweepFolder::resumed() const {
  static const std::vector<std::filesystem::path> none;
  return impl_->leftovers ? impl_->leftovers->folders() : none;
}

std::filesystem::path SweepFolder::failed() const { return impl_->folder.failed(); }
const std::filesystem::path& SweepFolder::partial() const { return impl_->folder.partial(); }

const internal::OutputFolder& SweepFolder::files() const { return impl_->folder; }

void SweepFolder::AddFile(const std::string& name, const std::string& text) {
  impl_->folder.Write(name, text);
}

void SweepFolder::Write(const SweepResult& result, const std::vector<SweepSummary>& summaries,
                        const Config& config) {
  const OutputFolder& folder = impl_->folder;
  impl_->WriteConfig(config);
  folder.Write("sweep.json", SweepJson(result, summaries));
  const Parts parts = {{&result, ""}};
  WriteRuns(folder, parts, "");
  WriteFailures(folder, parts, "");
  if (impl_->shard && !result.stopped) WriteShardRuns(folder, parts);
  folder.Write("table.md", internal::SweepMarkdown(result, summaries));
  impl_->Commit(result.stopped);
}

std::string SweepFolder::Write(const VariedSweep& sweep, const Config& config,
                               const std::function<bool()>& stop) {
  const OutputFolder& folder = impl_->folder;
  const Parts parts = PartsOf(sweep);
  impl_->WriteConfig(config);
  folder.Write("sweep.json", SweepJson(sweep));
  internal::WriteSweepCsv(folder, sweep);
  WriteRuns(folder, parts, sweep.variation.key);
  WriteFailures(folder, parts, sweep.variation.key);
  if (impl_->shard && !sweep.stopped()) WriteShardRuns(folder, parts);
  folder.Write("table.md", internal::VariedMarkdown(sweep));
  internal::WriteReprojection(folder, sweep);
  std::string note = internal::DrawVariation(folder, sweep, stop);
  if (note.empty()) note = internal::DrawReprojection(folder, sweep, stop);
  impl_->Commit(sweep.stopped());
  return note;
}

}  // namespace alidade
