// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/live_run.h"

#include <atomic>
#include <nlohmann/json.hpp>

#include "alidade/base/text.h"
#include "alidade/io/output_folder.h"
#include "alidade/io/read_file.h"
#include "alidade/record/column_tables.h"
#include "alidade/record/estimator_files.h"
#include "alidade/record/run_json.h"
#include "alidade/report/live_server.h"
#include "alidade/report/page_text.h"
#include "alidade/report/run_data.h"

namespace alidade {
namespace {

using internal::Json;

/// Returns the degrees of freedom of the NEES of each owner, with their keys in run.json. All
/// blocks of an owner that have a truth count.
Json DegreesOfFreedom(const Problem& problem, const std::vector<StreamInfo>& truths) {
  std::map<std::string, double> dof;
  for (const internal::BlockLayout& block : internal::BlockLayoutsOf(problem, truths)) {
    const bool is_estimated = problem.layout[block.id].status == BlockStatus::kEstimated;
    if (block.truth >= 0 && is_estimated) {
      dof["nees.dof:" + block.owner()] += static_cast<double>(block.tangent());
    }
  }
  return dof;
}

/// Returns the entry of an estimator in run.json. Results are not part of it.
Json EntryOf(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths) {
  EstimatorResult result;
  result.name = spec.name;
  result.type = spec.type;
  result.kind = spec.kind;
  result.sensors = internal::NamesOf(spec.problem.sensors);
  const BlockId position = internal::PositionBlockOf(spec.problem);
  if (position >= 0) result.position_block = spec.problem.layout[position].name;
  const internal::RecordedEstimator recorded = internal::EstimatorFiles::Describe(spec);
  Json entry = internal::EstimatorJson(result, &recorded);
  for (const char* const key : {"verdict", "diagnosis"}) entry.erase(key);
  entry["metrics"] = DegreesOfFreedom(spec.problem, truths);
  return entry;
}

}  // namespace

struct LiveRun::Impl {
  Impl(std::uint16_t port, const std::filesystem::path& run_folder, const Config& run_config);

  /// Returns facts and results of the rows so far. Adds their columns to `pool`.
  Json Data(internal::ColumnPool& pool) const;
  std::string Update() const;

  std::filesystem::path folder, partial;
  Config config;
  std::string title;
  Json run;  ///< run.json of the unfinished run
  std::atomic<Timestamp> first = kNoTimestamp;
  internal::LiveServer server;
};

LiveRun::Impl::Impl(std::uint16_t port, const std::filesystem::path& run_folder,
                    const Config& run_config)
    : folder(run_folder),
      partial(internal::PartialOf(run_folder)),
      config(run_config.Copy()),  // reading a config records the keys, so threads need copies
      title("Run"),
      server(port, {[this] {
                      internal::ColumnPool pool;
                      return internal::PageText(Data(pool), pool);
                    },
                    [this] { return Update(); }}) {
  if (const auto text = config.root().Find("title")) title = text->Text();
}

Json LiveRun::Impl::Data(internal::ColumnPool& pool) const {
  const internal::RunRows rows{kRows, first};  // `first` may be set at any time
  Json data = {{"title", title},
               {"status", "running"},
               {"live", {{"rows", kRows}, {"dropped", server.dropped()}}}};
  if (rows.origin != kNoTimestamp) {
    data["run"] = internal::RunData(partial, run, config.root(), rows, pool);
  }
  return data;
}

std::string LiveRun::Impl::Update() const {
  internal::ColumnPool pool;
  const Json data = Data(pool);
  if (!data.contains("run") || data.at("run").is_null()) return "";
  return internal::DataText(data, pool);
}

LiveRun::LiveRun(std::uint16_t port, const std::filesystem::path& folder, const Config& config)
    : impl_(std::make_unique<Impl>(port, folder, config)) {}

LiveRun::~LiveRun() = default;

void LiveRun::Begin(const Experiment& experiment) {
  impl_->run = {{"status", "running"}, {"estimators", Json::object()}};
  for (const EstimatorSpec& spec : experiment.estimators) {
    impl_->run["estimators"][spec.name] = EntryOf(spec, experiment.source->truths());
  }
  impl_->server.Start();
}

void LiveRun::OnFrame(const SourceFrame& frame) {
  if (impl_->first == kNoTimestamp) impl_->first = frame.timestamp;
}

void LiveRun::Finish() {
  const std::filesystem::path report = impl_->folder / "report.html";
  const Json live = {{"dropped", impl_->server.dropped()}, {"report", report.string()}};
  const std::string page = internal::ReadFile(report, [&](ExitCode code, int) {
    throw Error(code, ErrorLine(Place{report.string()}, {}, "the page cannot be read"));
  });
  impl_->server.Finish(internal::LiveDataOf(page, live));
}

std::string LiveRun::address() const {
  return "http://127.0.0.1:" + std::to_string(impl_->server.port()) + '/';
}

std::int64_t LiveRun::dropped() const { return impl_->server.dropped(); }

}  // namespace alidade
