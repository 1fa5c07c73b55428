// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/recorder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>

#include "alidade/experiment/metric_rows.h"
#include "alidade/io/json.h"
#include "alidade/io/log.h"
#include "alidade/io/output_folder.h"
#include "alidade/io/read_file.h"
#include "alidade/record/column_tables.h"
#include "alidade/record/data_hash.h"
#include "alidade/record/estimator_files.h"
#include "alidade/record/figures.h"
#include "alidade/record/landmarks_file.h"
#include "alidade/record/landmarks_ply.h"
#include "alidade/record/log_file.h"
#include "alidade/record/report_html.h"
#include "alidade/record/run_json.h"
#include "alidade/record/source_files.h"
#include "alidade/record/timing_file.h"
#include "alidade/replay/replay.h"
#include "alidade/replay/run_inputs.h"

namespace alidade {

using Clock = std::chrono::steady_clock;

struct Recorder::Impl {
  Impl(const Options& recorder_options, const Config& run_config);

  internal::RecordedRun CloseFiles();
  void WriteEvents(const EstimatorResult& result);
  std::string TimingJson(const RunResult& result) const;
  void WriteReport(const RunResult& result);
  /// Writes all files except run.json. Returns the error that occurred while the report was
  /// written, or null if there was no error.
  std::exception_ptr WriteResults(const RunResult& result);

  Options options;
  internal::OutputFolder folder;
  internal::LogFile log{folder};
  const Config config;
  std::string title, config_text;
  internal::RunFacts facts;
  std::vector<std::string> subjects;  ///< result of SubjectsOf(experiment)
  internal::RunColumns run_columns;
  std::optional<internal::SourceFiles> source;
  std::optional<internal::DataHash> data;
  std::optional<internal::TimingFile> timing;
  std::vector<std::unique_ptr<internal::EstimatorFiles>> estimators;
  std::vector<std::string> highlights;
  std::string note;
  Clock::time_point started = Clock::now();
  std::time_t started_at = std::time(nullptr);
};

namespace {

constexpr const char* kRunFile = "run.json";
constexpr const char* kColumnsFile = "columns.json";

/// Names of the parts of a frame in timing.json, indexed by FramePart.
constexpr std::array<const char*, kFrameParts> kPartNames = {"step", "evaluate", "gate", "update",
                                                             "landmarks"};

/// Returns the text of `key` in `map`. Returns `fallback` if the key does not exist.
std::string TextOf(const Node& map, std::string_view key, const std::string& fallback) {
  const std::optional<Node> node = map.is_map() ? map.Find(key) : std::nullopt;
  return node && node->kind() == Node::Kind::kScalar ? node->Text() : fallback;
}

/// Returns the svg element in the text of an SVG file, without the XML prolog.
std::string SvgElement(const std::string& svg) {
  const std::size_t start = svg.find("<svg");
  return start == svg.npos ? "" : svg.substr(start);
}

}  // namespace

Recorder::Impl::Impl(const Options& recorder_options, const Config& run_config)
    : options(recorder_options),
      folder(options.folder, options.force),
      config(run_config),
      title(TextOf(config.root(), "title", std::filesystem::path(config.name()).stem().string())),
      config_text(config.ToYaml()) {
  facts.plugins = options.plugins;
  folder.Write(kRunFile, internal::UnfinishedRunJson("running", ""));
  folder.Write(internal::kResolvedConfig, config_text);
  if (!options.inputs.empty()) folder.Write(internal::kInputsFile, options.inputs);
}

internal::RecordedRun Recorder::Impl::CloseFiles() {
  internal::RecordedRun recorded;
  if (source) {
    source->Close();
    source->Describe(recorded);
  }
  if (timing) {
    timing->Close();
    timing->Describe(recorded);
  }
  for (const auto& estimator : estimators) {
    estimator->Close(folder, run_columns);
    recorded.estimators.push_back(estimator->recorded());
  }
  return recorded;
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

void Recorder::Impl::WriteReport(const RunResult& result) {
  internal::Report report{title, config_text, facts, {}, {}, subjects};
  if (options.figures) {
    const auto limit = std::chrono::duration<double>(options.drawing_s);
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
    report.figures = internal::DrawFigures(folder, facts.recorded, {options.stop, end});
  } else {
    report.figures.note = "figures were not requested";
  }
  for (const internal::Figure& figure : report.figures.drawn) {
    const std::string svg = "figures/" + figure.name + ".svg";
    // The page only links a figure with wall-clock times, so that the page itself is reproducible.
    report.svgs[figure.name] =
        internal::HasWallClock(svg)
            ? "<img src=\"" + svg + "\" alt=\"" + figure.title + "\">"
            : SvgElement(internal::ReadFile(folder.partial() / svg, [](ExitCode, int) {}));
  }
  folder.Write("report.html", internal::ReportHtml(result, report));
  highlights = {"report.html"};
  if (report.figures.has_png) highlights.emplace_back("figures/measurements.png");
  highlights.insert(highlights.end(), {"comparison.csv", "run.json"});
  if (options.figures) note = report.figures.note;
  if (!note.empty()) Log(LogLevel::kWarning, note);
}

Recorder::Recorder(const Options& options, const Config& config)
    : impl_(std::make_unique<Impl>(options, config)) {}

Recorder::~Recorder() = default;

void Recorder::Begin(const Experiment& experiment) {
  impl_->facts.seed = experiment.seed;
  impl_->subjects = internal::SubjectsOf(experiment);
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

std::exception_ptr Recorder::Impl::WriteResults(const RunResult& result) {
  const std::string timing_json = TimingJson(result);
  internal::RecordedRun& recorded = facts.recorded = CloseFiles();
  for (std::size_t e = 0; e < result.estimators.size(); ++e) {
    const EstimatorResult& estimator = result.estimators[e];
    WriteEvents(estimator);
    if (!estimator.landmarks) continue;
    const std::vector<LandmarkEstimate> map = internal::AllLandmarks(estimator);
    internal::WriteLandmarks(folder, estimator.name, map, run_columns);
    folder.Write(estimator.name + "/landmarks.ply", internal::LandmarksPly(map));
    if (e >= recorded.estimators.size()) continue;
    recorded.estimators[e].map = internal::DescribeMap(map);
  }
  if (data) {
    facts.measurements_sha256 = data->measurements();
    facts.truth_sha256 = data->truth();
  }
  folder.Write(kColumnsFile, internal::ColumnsJson(run_columns));
  folder.Write("comparison.csv", internal::ComparisonCsv(result));
  folder.Write("timing.json", timing_json);
  try {
    WriteReport(result);
  } catch (const Error&) {
    folder.Remove("report.html");
    folder.Remove("figures");
    return std::current_exception();
  }
  return nullptr;
}

void Recorder::Finish(const RunResult& result) {
  std::exception_ptr without_report;
  try {
    without_report = impl_->WriteResults(result);
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
  impl_->folder.Commit();
  if (without_report) std::rethrow_exception(without_report);
  if (IsLogged(LogLevel::kInfo)) Log(LogLevel::kInfo, "wrote " + impl_->options.folder.string());
}

const std::vector<std::string>& Recorder::highlights() const { return impl_->highlights; }
const std::string& Recorder::note() const { return impl_->note; }
const std::filesystem::path& Recorder::folder() const { return impl_->options.folder; }

}  // namespace alidade
