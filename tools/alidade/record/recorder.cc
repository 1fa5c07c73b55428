// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/recorder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>
#include <optional>

#include "alidade/io/json.h"
#include "alidade/io/log.h"
#include "alidade/io/output_folder.h"
#include "alidade/record/column_tables.h"
#include "alidade/record/data_hash.h"
#include "alidade/record/estimator_files.h"
#include "alidade/record/landmarks_file.h"
#include "alidade/record/landmarks_ply.h"
#include "alidade/record/log_file.h"
#include "alidade/record/run_conclusions.h"
#include "alidade/record/run_json.h"
#include "alidade/record/source_files.h"
#include "alidade/record/timing_file.h"
#include "alidade/replay/run_inputs.h"
#include "alidade/report/page_text.h"

namespace alidade {

using Clock = std::chrono::steady_clock;

struct Recorder::Impl {
  Impl(const Options& recorder_options, const Config& config);

  void CloseFiles(const RunResult& result);
  void WriteEvents(const EstimatorResult& result);
  std::string TimingJson(const RunResult& result) const;
  /// Writes all files except run.json and the page.
  void WriteResults(const RunResult& result);

  Options options;
  internal::OutputFolder folder;
  internal::LogFile log{folder};
  internal::RunFacts facts;
  internal::RunColumns run_columns;
  std::optional<internal::SourceFiles> source;
  std::optional<internal::DataHash> data;
  std::optional<internal::TimingFile> timing;
  std::vector<std::unique_ptr<internal::EstimatorFiles>> estimators;
  Clock::time_point started = Clock::now();
  std::time_t started_at = std::time(nullptr);
};

namespace {

constexpr const char* kRunFile = "run.json";
constexpr const char* kColumnsFile = "columns.json";

/// Names of the parts of a frame in timing.json, indexed by FramePart.
constexpr std::array<const char*, kFrameParts> kPartNames = {"step", "evaluate", "gate", "update",
                                                             "landmarks"};

}  // namespace

Recorder::Impl::Impl(const Options& recorder_options, const Config& config)
    : options(recorder_options), folder(options.folder, options.force) {
  facts.plugins = options.plugins;
  folder.SetMaxDelay(options.max_delay);
  folder.Write(kRunFile, internal::UnfinishedRunJson("running", ""));
  folder.Write(internal::kResolvedConfig, config.ToYaml());
  if (!options.inputs.empty()) folder.Write(internal::kInputsFile, options.inputs);
}

void Recorder::Impl::CloseFiles(const RunResult& result) {
  if (source) source->Close();
  if (timing) timing->Close();
  std::vector<internal::EstimateHistory> histories;
  for (const auto& estimator : estimators) {
    estimator->Close(folder, run_columns);
    facts.recorded.push_back(estimator->recorded());
    histories.push_back(estimator->history());
  }
  facts.conclusions = internal::ConclusionsOf(result, histories);
}

void Recorder::Impl::WriteEvents(const EstimatorResult& result) {
  std::vector<internal::Column> columns;
  internal::AppendColumns(internal::kEventColumns, internal::NoLayout{}, columns);
  internal::CsvFile file =
      internal::CreateCsv(folder, result.name + "/events.csv", std::move(columns), run_columns);
  for (const Event& event : result.events) {
    internal::WriteCells(internal::kEventColumns, internal::NoLayout{}, event, file);
    file.EndRow();
  }
  file.Close();
}

std::string Recorder::Impl::TimingJson(const RunResult& result) const {
  const double wall_s = std::chrono::duration<double>(Clock::now() - started).count();
  char start[32] = "";
  std::tm utc{};
  if (gmtime_r(&started_at, &utc) != nullptr) {
    std::strftime(start, sizeof start, "%Y-%m-%dT%H:%M:%SZ", &utc);
  }
  internal::Json json = {{"started", start},
                         {"command", options.command},
                         {"wall_s", wall_s},
                         {"frames_per_s", static_cast<double>(result.frames) / wall_s}};
  internal::Json& times = json["estimators"] = internal::Json::object();
  for (const EstimatorResult& estimator : result.estimators) {
    internal::Json& entry =
        times[estimator.name] = {{"wall_s", estimator.wall_s}, {"record_s", estimator.record_s}};
    if (std::ranges::max(estimator.parts_s) == 0.0) continue;
    for (std::size_t i = 0; i < kPartNames.size(); ++i) {
      entry["parts_s"][kPartNames[i]] = estimator.parts_s[i];
    }
  }
  json["arrivals"] = {{"out_of_sequence", result.arrivals.out_of_sequence},
                      {"merged", result.arrivals.merged},
                      {"dropped", result.arrivals.dropped},
                      {"longest_lag_s", Seconds(result.arrivals.longest_lag)}};
  return internal::JsonText(json);
}

Recorder::Recorder(const Options& options, const Config& config)
    : impl_(std::make_unique<Impl>(options, config)) {}

Recorder::~Recorder() = default;

void Recorder::Begin(const Experiment& experiment) {
  impl_->facts.seed = experiment.seed;
  impl_->source.emplace(impl_->folder, experiment, impl_->run_columns);
  impl_->data.emplace(experiment.source->streams(), experiment.source->truths());
  impl_->timing.emplace(impl_->folder, experiment, impl_->run_columns);
  for (const EstimatorSpec& spec : experiment.estimators) {
    impl_->estimators.push_back(std::make_unique<internal::EstimatorFiles>(
        impl_->folder, spec, impl_->source->truth_layout(), impl_->options.covariances,
        impl_->run_columns));
  }
  impl_->folder.Write(kColumnsFile, internal::ColumnsJson(impl_->run_columns));
  impl_->started = Clock::now();
}

void Recorder::OnFrame(const SourceFrame& frame) {
  ALIDADE_EXPECTS(impl_->source.has_value());
  impl_->folder.Retain();
  impl_->source->Add(frame);
  impl_->data->Add(frame);
  impl_->timing->Add(frame);
}

void Recorder::OnTime(int estimator, double wall_s) {
  ALIDADE_EXPECTS(impl_->timing.has_value());
  impl_->timing->AddTime(estimator, wall_s);
}

void Recorder::OnEstimate(int estimator, const SourceFrame& frame, const State& state,
                          const UpdateReport& report) {
  ALIDADE_EXPECTS(estimator >= 0 && estimator < static_cast<int>(impl_->estimators.size()));
  impl_->estimators[static_cast<std::size_t>(estimator)]->Add(frame, state, report);
}

void Recorder::AddFile(const std::string& name, std::string_view text) {
  impl_->folder.Write(name, text);
}

void Recorder::Impl::WriteResults(const RunResult& result) {
  const std::string timing_json = TimingJson(result);
  CloseFiles(result);
  for (const EstimatorResult& estimator : result.estimators) {
    WriteEvents(estimator);
    if (!estimator.landmarks) continue;
    const std::vector<LandmarkEstimate> map = internal::AllLandmarks(estimator);
    internal::WriteLandmarks(folder, estimator.name, map, run_columns);
    folder.Write(estimator.name + "/landmarks.ply", internal::LandmarksPly(map));
  }
  if (data) {
    facts.measurements_sha256 = data->measurements();
    facts.truth_sha256 = data->truth();
  }
  folder.Write(kColumnsFile, internal::ColumnsJson(run_columns));
  folder.Write("comparison.csv", internal::ComparisonCsv(result));
  folder.Write("timing.json", timing_json);
}

void Recorder::Finish(const RunResult& result) {
  try {
    impl_->WriteResults(result);
    impl_->log.Close();
    impl_->folder.Write(kRunFile, internal::RunJson(result, impl_->facts));
  } catch (...) {
    try {
      const std::string reason = CaughtFailure().reason;
      impl_->folder.Write(kRunFile, internal::UnfinishedRunJson("failed", reason));
    } catch (const Error&) {  // ignored: the disk may be full
    }
    throw;
  }
  internal::CommitWithPage(impl_->folder);
  if (IsLogged(LogLevel::kInfo)) Log(LogLevel::kInfo, "wrote " + impl_->options.folder.string());
}

const std::vector<internal::Conclusion>& Recorder::conclusions() const {
  return impl_->facts.conclusions;
}
const std::filesystem::path& Recorder::folder() const { return impl_->options.folder; }

}  // namespace alidade
