// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/sweep.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

#include "alidade/io/log.h"
#include "alidade/sweep/finished_runs.h"
#include "alidade/sweep/mean_interval.h"
#include "alidade/sweep/processors.h"
#include "alidade/sweep/reprojection.h"
#include "alidade/sweep/sweep_config.h"

namespace alidade {

namespace {

/// Queue of the runs of a sweep, which several threads process.
class RunQueue {
 public:
  RunQueue(const Config& config, const PluginHost& host, const SweepOptions& options,
           std::uint64_t first_seed, std::int64_t runs)
      : config_(config), host_(host), options_(options), first_seed_(first_seed), runs_(runs) {}

  /// Executes runs until the queue is empty or an exception occurs. Release() rethrows the
  /// exception.
  void ExecuteRuns() noexcept {
    try {
      const Config config = CopyOfConfig();
      while (ExecuteNextRun(config)) continue;
    } catch (...) {
      const std::lock_guard lock(mutex_);
      exception_ = std::current_exception();
      next_ = runs_;
    }
  }

  /// Returns the finished runs, sorted by seed, and removes them from the queue.
  std::vector<SweepRun> Release() {
    if (exception_) std::rethrow_exception(exception_);
    std::sort(done_.begin(), done_.end(),
              [](const SweepRun& a, const SweepRun& b) { return a.seed < b.seed; });
    return std::move(done_);
  }

 private:
  bool Stopped() const { return options_.stop && options_.stop(); }

  /// Executes the next run. Returns false if there are no more runs. After a stop, only runs of the
  /// earlier sweep are added.
  bool ExecuteNextRun(const Config& config) {
    const std::int64_t index = next_++;
    if (index >= runs_) return false;
    const std::uint64_t seed = first_seed_ + static_cast<std::uint64_t>(index);
    const SweepRun* const earlier =
        options_.finished == nullptr ? nullptr : options_.finished->Find(options_.value, seed);
    if (earlier == nullptr && Stopped()) return true;
    SweepRun run = earlier != nullptr ? *earlier : RunSeed(config, seed);
    if (run.status == RunStatus::kStopped) return true;
    if (earlier == nullptr && options_.finished != nullptr && run.status == RunStatus::kOk) {
      options_.finished->Add(options_.value, run);
    }
    const std::lock_guard lock(mutex_);
    run.ShareNames(names_);
    done_.push_back(std::move(run));
    if (options_.progress) options_.progress(static_cast<std::int64_t>(done_.size()), runs_);
    return true;
  }

  /// Returns a copy of the config for one thread. Each thread needs a copy, because a query marks
  /// keys of a config as read.
  Config CopyOfConfig() {
    const std::lock_guard lock(mutex_);
    return config_.Copy();
  }

  SweepRun RunSeed(const Config& base, std::uint64_t seed) {
    SweepRun run;
    run.seed = seed;
    const LogScope log("seed " + std::to_string(seed) + ": ", LogLevel::kInfo);
    try {
      Config config = base.Copy();
      config.Set("source.seed", std::to_string(seed), "--first-seed");
      Experiment experiment = BuildExperiment(config, host_);
      for (EstimatorSpec& spec : experiment.estimators) {
        spec.on_divergence = OnDivergence::kReport;
      }
      RunOptions options;
      options.stop = options_.stop;
      if (seed == first_seed_ && options_.first_run_progress) {
        options.progress = [this](std::int64_t done, std::int64_t total) {
          const std::lock_guard lock(mutex_);
          if (done_.empty()) options_.first_run_progress(done, total);
        };
      }
      internal::ReprojectionRecorder reprojection;
      if (!options_.value.empty()) options.observers = {&reprojection};
      RunResult result =
          options_.run ? options_.run(experiment, options) : Run(experiment, options);
      run.status = result.code == ExitCode::kDiverged ? RunStatus::kOk : result.status;
      run.code = result.code;
      run.reason = std::move(result.reason);
      run.withheld = !result.withheld.empty();
      for (const EstimatorResult& estimator : result.estimators) {
        run.estimators.emplace_back(estimator);
      }
      run.reprojection = reprojection.Release();
    } catch (...) {
      Failure failure = CaughtFailure();
      run.status = RunStatus::kFailed;
      run.code = failure.code;
      run.reason = std::move(failure.reason);
    }
    return run;
  }

  const Config& config_;
  const PluginHost& host_;
  const SweepOptions& options_;
  const std::uint64_t first_seed_;
  const std::int64_t runs_;
  std::atomic<std::int64_t> next_{0};
  std::mutex mutex_;
  std::vector<SweepRun> done_;
  SharedNames names_;
  std::exception_ptr exception_;
};

/// Returns true if every loaded model allows several instances at once. All models of the host are
/// checked, because the models that a config uses are known only after the experiment is built.
bool MayRunInParallel(const PluginHost& host) {
  return std::ranges::all_of(host.entries(), [](const PluginEntry& entry) {
    return !entry.is_model() || (entry.thread_flags & ALIDADE_THREAD_INSTANCES) != 0;
  });
}

}  // namespace

SweepResult Sweep(const Config& config, const PluginHost& host, const SweepOptions& options) {
  if (options.runs > 1 && !internal::UsesSeed(config, host, options.first_seed)) {
    internal::FailUnseeded(config);
  }
  return internal::SweepSeeds(config, host, options);
}

SweepResult internal::SweepSeeds(const Config& config, const PluginHost& host,
                                 const SweepOptions& options) {
  ALIDADE_EXPECTS(options.runs > 0 && options.jobs >= 0);
  SweepResult result;
  CheckReadableAgain(config);
  // A trial build reports errors of the config once, before the first run.
  {
    const Experiment experiment = BuildExperiment(config, host);
    for (const EstimatorSpec& spec : experiment.estimators) {
      result.estimators.push_back(spec.name);
    }
    if (experiment.reference >= 0) {
      result.reference = result.estimators[static_cast<std::size_t>(experiment.reference)];
    }
  }
  const SeedRange seeds =
      SeedsOf(options.shard.value_or(Shard{}), options.first_seed, options.runs);
  result.runs = seeds.count;
  result.first_seed = seeds.first;

  RunQueue queue(config, host, options, result.first_seed, result.runs);
  const std::int64_t jobs = options.jobs > 0 ? options.jobs : UsableProcessors();
  const std::int64_t thread_count = MayRunInParallel(host) ? jobs : 1;
  {
    std::vector<std::jthread> threads;
    for (std::int64_t i = 1; i < std::min(thread_count, result.runs); ++i) {
      try {
        threads.emplace_back([&queue] { queue.ExecuteRuns(); });
      } catch (const std::system_error&) {
        break;  // the system refuses more threads; continue with the existing threads
      }
    }
    queue.ExecuteRuns();
  }
  result.done = queue.Release();
  result.stopped = static_cast<std::int64_t>(result.done.size()) < result.runs;
  return result;
}

namespace {

/// Collector of the values of one estimator over all runs, by name.
class ValuesByName {
 public:
  /// Adds the values of one run, except NaN.
  void Add(const NamedValues<double>& row) {
    if (&row.names() != names_) {
      names_ = &row.names();
      lists_.clear();
      for (const std::string& name : row.names()) lists_.push_back(&values_[name]);
    }
    for (std::size_t i = 0; i < lists_.size(); ++i) {
      const double value = row.values()[i];
      if (!std::isnan(value)) lists_[i]->push_back(value);
    }
  }
  /// Computes the statistics of each name with at least one value. Consumes the values.
  void Summarise(SweepSummary& summary) && {
    for (auto& [name, list] : values_) {
      if (list.empty()) continue;
      summary.mean_intervals[name] = internal::MeanInterval(list);
      summary.metrics[name] = SpreadOf(std::move(list));
    }
  }

 private:
  std::map<std::string, std::vector<double>> values_;
  const std::vector<std::string>* names_ = nullptr;  ///< names of the previous row
  std::vector<std::vector<double>*> lists_;          ///< entries of values_ for these names
};

void AddUnits(const NamedValues<std::string>& row, std::map<std::string, std::string>& units) {
  for (std::size_t i = 0; i < row.names().size(); ++i) {
    units.try_emplace(row.names()[i], row.values()[i]);
  }
}

SweepSummary SummaryOf(const SweepResult& result, const std::string& name) {
  SweepSummary summary;
  summary.name = name;
  ValuesByName values;
  const std::vector<std::string>* units = nullptr;  // names of the units of the previous run
  for (const SweepRun& run : result.done) {
    for (const SweepRow& row : run.estimators) {
      if (row.name != name) continue;
      if (&row.units.names() != units) AddUnits(row.units, summary.units);
      units = &row.units.names();
      summary.diverged += row.diverged ? 1 : 0;
      if (run.status == RunStatus::kOk) {
        ++summary.verdicts[static_cast<std::size_t>(row.verdict)];
      }
      if (!run.UsesMetricsOf(row)) continue;
      ++summary.used;
      values.Add(row.metrics);
    }
  }
  std::move(values).Summarise(summary);
  return summary;
}

}  // namespace

std::vector<SweepSummary> Summarise(const SweepResult& result) {
  std::vector<SweepSummary> summaries;
  for (const std::string& name : result.estimators) summaries.push_back(SummaryOf(result, name));
  return summaries;
}

}  // namespace alidade
