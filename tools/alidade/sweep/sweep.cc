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
#include "alidade/sweep/processors.h"
#include "alidade/sweep/reprojection.h"
#include "alidade/sweep/sweep_config.h"

namespace alidade {

namespace {

/// The runs of a sweep, handed out to threads one after the other.
class Queue {
 public:
  Queue(const Config& config, const PluginHost& host, const SweepOptions& options,
        std::uint64_t first_seed, std::int64_t runs)
      : config_(config), host_(host), options_(options), first_seed_(first_seed), runs_(runs) {}

  /// Takes runs until there are none left. What ends it before that, Take() throws.
  void Work() noexcept {
    try {
      const Config config = CopyOfConfig();
      while (TakeOne(config)) continue;
    } catch (...) {
      const std::lock_guard lock(mutex_);
      thrown_ = std::current_exception();
      next_ = runs_;
    }
  }

  /// The finished ones, by seed.
  std::vector<SweepRun> Take() {
    if (thrown_) std::rethrow_exception(thrown_);
    std::sort(done_.begin(), done_.end(),
              [](const SweepRun& a, const SweepRun& b) { return a.seed < b.seed; });
    return std::move(done_);
  }

 private:
  bool Stopped() const { return options_.stop && options_.stop(); }

  /// False where none is left. Once it is stopped, only those that were finished before are taken.
  bool TakeOne(const Config& config) {
    const std::int64_t index = next_++;
    if (index >= runs_) return false;
    const std::uint64_t seed = first_seed_ + static_cast<std::uint64_t>(index);
    const SweepRun* const known =
        options_.finished == nullptr ? nullptr : options_.finished->Find(options_.value, seed);
    if (known == nullptr && Stopped()) return true;
    SweepRun run = known != nullptr ? *known : RunSeed(config, seed);
    if (run.status == RunStatus::kStopped) return true;
    if (known == nullptr && options_.finished != nullptr && run.status == RunStatus::kOk) {
      options_.finished->Add(options_.value, run);
    }
    const std::lock_guard lock(mutex_);
    run.ShareNames(names_);
    done_.push_back(std::move(run));
    if (options_.progress) options_.progress(static_cast<std::int64_t>(done_.size()), runs_);
    return true;
  }

  /// For one thread: asking marks keys as read.
  Config CopyOfConfig() {
    const std::lock_guard lock(mutex_);
    return config_.Copy();
  }

  SweepRun RunSeed(const Config& from, std::uint64_t seed) {
    SweepRun run;
    run.seed = seed;
    const LogScope log("seed " + std::to_string(seed) + ": ", LogLevel::kInfo);
    try {
      Config config = from.Copy();
      config.Set("source.seed", std::to_string(seed), "--first-seed");
      Experiment experiment = BuildExperiment(config, host_);
      for (EstimatorSpec& spec : experiment.estimators) {
        spec.on_divergence = OnDivergence::kReport;
      }
      RunOptions options;
      options.stop = options_.stop;
      internal::ReprojectionOfRun reprojection;
      if (!options_.value.empty()) options.observers = {&reprojection};
      RunResult result =
          options_.run ? options_.run(experiment, options) : Run(experiment, options);
      run.status = result.code == ExitCode::kDiverged ? RunStatus::kOk : result.status;
      run.code = result.code;
      run.reason = std::move(result.reason);
      run.withheld = !result.withheld.empty();
      for (const EstimatorResult& one : result.estimators) run.estimators.emplace_back(one);
      run.reprojection = reprojection.Take();
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
  std::exception_ptr thrown_;
};

/// Whether every model on offer may work in several instances at once. Asked of all that the host
/// has opened: which ones a config uses is known only to those who build it.
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
  // What is wrong with the config is said once, before the first run.
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

  Queue queue(config, host, options, result.first_seed, result.runs);
  const std::int64_t jobs = options.jobs > 0 ? options.jobs : UsableProcessors();
  const std::int64_t wanted = MayRunInParallel(host) ? jobs : 1;
  {
    std::vector<std::jthread> threads;
    for (std::int64_t i = 1; i < std::min(wanted, result.runs); ++i) {
      try {
        threads.emplace_back([&queue] { queue.Work(); });
      } catch (const std::system_error&) {
        break;  // no more threads are to be had; these do
      }
    }
    queue.Work();
  }
  result.done = queue.Take();
  result.stopped = static_cast<std::int64_t>(result.done.size()) < result.runs;
  return result;
}

namespace {

/// The values of one estimator over all runs, by name.
class ValuesByName {
 public:
  /// But for those that are not a number.
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
  /// Of each name that has one.
  std::map<std::string, Spread> TakeSpreads() {
    std::map<std::string, Spread> spreads;
    for (auto& [name, list] : values_) {
      if (!list.empty()) spreads[name] = SpreadOf(std::move(list));
    }
    return spreads;
  }

 private:
  std::map<std::string, std::vector<double>> values_;
  const std::vector<std::string>* names_ = nullptr;  ///< of the row before
  std::vector<std::vector<double>*> lists_;          ///< its places in values_
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
  const std::vector<std::string>* units = nullptr;  // of the run before
  for (const SweepRun& run : result.done) {
    for (const SweepRow& one : run.estimators) {
      if (one.name != name) continue;
      if (&one.units.names() != units) AddUnits(one.units, summary.units);
      units = &one.units.names();
      summary.diverged += one.diverged ? 1 : 0;
      if (!run.Uses(one)) continue;
      ++summary.used;
      summary.inconsistent += one.inconsistent ? 1 : 0;
      values.Add(one.metrics);
    }
  }
  summary.metrics = values.TakeSpreads();
  return summary;
}

}  // namespace

std::vector<SweepSummary> Summarise(const SweepResult& result) {
  std::vector<SweepSummary> summaries;
  for (const std::string& name : result.estimators) summaries.push_back(SummaryOf(result, name));
  return summaries;
}

}  // namespace alidade
