// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/experiment/estimator_plugin.h"
#include "condensed_run.h"
#include "fixed_lag.h"
#include "incremental_solve.h"
#include "initialising_filter.h"
#include "map_solve.h"
#include "sparse_solve.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kManyInputs = 1000;         // of which a dense solve takes seconds
constexpr int kFewInputs = 200;           // of which it takes less than 0.1 s
constexpr int kMostInputs = 100'000'000;  // of a sparse solve, which SparseSolve may refuse before

enum class Mode { kSmoothing, kFiltering, kIncremental };

struct BatchOptions {
  Mode mode = Mode::kSmoothing;
  double relinearise_above = 0.0;  ///< sigma, where incremental
  SolveOptions solve;
};

/// Maximum a posteriori of all states given all data, or given the data so far (the
/// full-information filter): see CondensedRun for the problem; MapSolve, SparseSolve, and
/// IncrementalSolve for its solution.
class CeresBatch : public Estimator {
 public:
  CeresBatch(const Problem& problem, const BatchOptions& options,
             const std::vector<StreamInfo>& streams)
      : mode_(options.mode),
        options_(options.solve),
        run_(problem, streams, options_.max_dt_s, MayBeSparse() ? kMostInputs : kMostDenseInputs),
        solve_(options_),
        state_(problem.InitialState(/*reserved=*/true)),
        initialiser_(problem, options_.max_dt_s, streams) {
    // The full-information filter of no landmarks too: it takes what it touches to the last digit.
    const bool as_filtering = mode_ == Mode::kFiltering && MayBeSparse() && !problem.landmarks;
    const double above = as_filtering ? 1e-9 : options.relinearise_above;
    if (mode_ == Mode::kIncremental || as_filtering) incremental_.emplace(run_, above);
  }

  void Start(Timestamp timestamp) override {
    run_.Start(timestamp);
    initialiser_.filter().Start(timestamp);
  }
  bool offline() const override { return mode_ == Mode::kSmoothing; }
  const State& state() const override { return state_; }
  std::vector<LandmarkEstimate> landmarks() const override {
    if (!incremental_ || !solved_so_) return map_;
    std::vector<LandmarkEstimate> map = initialiser_.filter().landmarks();
    if (!map.empty() && !incremental_->PutMap(map)) {
      for (LandmarkEstimate& one : map) {  // the filter's ids, and no places
        one.position.setConstant(std::nan(""));
        one.covariance.setConstant(std::nan(""));
      }
    }
    return map;
  }
  Timestamp timestamp() const override { return run_.timestamp(); }
  bool diverged() const override { return failed(); }
  bool failed() const override {
    return refused_ || solve_.failed() || (sparse_ && sparse_->failed());
  }

  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    if (failed()) return report_;
    const UpdateReport& filter = initialiser_.Process(frame);
    const bool were_few = run_.shape().inputs <= kManyInputs;
    refused_ = !run_.Add(frame, filter, initialiser_.filter(), filtered_);
    if (!refused_ && !offline()) SolveSoFar();
    if (failed()) report_.events.push_back({frame.timestamp, EventKind::kNoSolution, WhyFailed()});
    if (!refused_ && !MayBeSparse() && were_few && run_.shape().inputs > kManyInputs) {
      report_.events.push_back({frame.timestamp, EventKind::kSlow,
                                "more than " + std::to_string(kManyInputs) +
                                    " noise inputs: the time of a solve grows with their cube"});
    }
    initialiser_.AddReport(frame.timestamp, filter, report_.events);
    return report_;
  }

  void StopWhen(const std::function<bool()>& stop) override {
    if (!offline()) return;
    stop_ = stop;
    solve_.StopWhen(stop);
  }

  void Smooth(const Emit& emit) override {
    const std::size_t frames = run_.shape().frames;
    if (!refused_ && frames == 0) return;
    const SparseSolve::Take put = [&](std::size_t k, const auto& x, const auto& covariance) {
      solve_.HeedStop();
      run_.Put(k, x, covariance(), state_, report_);
      if (k + 1 == frames) {
        Note(report_.events);
        report_.events.push_back({run_.timestamp(), EventKind::kSolution, WhyFailed()});
        if (sparse_) sparse_->NoteInexact(run_.timestamp(), report_.events);
      }
      emit(k, state_, report_);
    };
    if (refused_ || !(IsSparse() ? SmoothSparse(put) : SmoothDense(put))) {
      throw Error(ExitCode::kDiverged, WhyFailed());
    }
  }

 private:
  const std::string& WhyFailed() const {
    if (refused_) return run_.problem();
    return sparse_ ? sparse_->summary() : solve_.summary();
  }

  bool MayBeSparse() const { return options_.solver != SolverKind::kDense; }
  /// Few inputs are solved for as fast without.
  bool IsSparse() const {
    return MayBeSparse() && (incremental_ || options_.solver == SolverKind::kSparse ||
                             run_.shape().inputs > kFewInputs);
  }

  bool SmoothDense(const SparseSolve::Take& put) {
    return solve_.SolveAll(run_, filtered_, e_) && PutAll([&](std::size_t k, const Point& point) {
             put(k, point.x, [&] { return CovarianceOf(point, solve_.u()); });
           });
  }

  bool SmoothSparse(const SparseSolve::Take& put) {
    sparse_.emplace(run_, options_);
    sparse_->StopWhen(stop_);
    const bool again = !offline() && e_.size() > 0;
    if (!(again ? sparse_->SolveAnew(filtered_, e_) : sparse_->SolveAll(filtered_))) return false;
    std::vector<LandmarkEstimate> map = initialiser_.filter().landmarks();
    if (!sparse_->PutAll(put, map)) return false;
    map_ = std::move(map);
    return true;
  }

  void Note(std::vector<Event>& events) {
    if (!sparse_) {
      solve_.Note(run_.timestamp(), events);
    } else if (offline()) {
      sparse_->Note(run_.timestamp(), events);
    } else {
      sparse_->NoteNew(run_.timestamp(), at_edge_, events);
    }
  }

  /// By what the frame touches alone, where that can be.
  bool SolveIncrementally() {
    solved_so_ = incremental_ && incremental_->Solve();
    if (!solved_so_) return false;
    told_why_ = false;
    e_.resize(0);  // of frames long ago
    run_.Put(run_.shape().frames - 1, incremental_->Values(), incremental_->Covariance(), state_,
             report_);
    return true;
  }

  /// From the solution of all frames. Says why once, until it goes on. Where it cannot, the next
  /// frame tries again with all frames.
  void RestartIncremental() {
    const std::string why = incremental_->problem();
    if (!incremental_->ended()) incremental_->Restart(e_);
    if (!told_why_ && mode_ == Mode::kIncremental) {
      report_.events.push_back(
          {run_.timestamp(), EventKind::kSolvedAsAWhole,
           why + (incremental_->ended() ? "; so are all frames from here on" : "")});
    }
    told_why_ = true;
    if (incremental_->ended()) incremental_.reset();
  }

  void SolveSoFar() {
    const std::size_t last = run_.shape().frames - 1;
    if (SolveIncrementally()) return;
    if (IsSparse()) {
      SmoothSparse([&](std::size_t k, const auto& x, const auto& covariance) {
        if (k == last) run_.Put(k, x, covariance(), state_, report_);
      });
      e_ = sparse_->inputs();
      if (incremental_ && !failed()) RestartIncremental();
    } else if (solve_.SolveAnew(run_, filtered_, e_)) {
      PutAll([&](std::size_t k, const Point& point) {
        if (k != last) return;
        run_.Put(k, point.x, CovarianceOf(point, solve_.u()), state_, report_);
      });
    }
    if (!failed()) Note(report_.events);
  }

  /// Gives `put` the points of the solution, and makes its map.
  bool PutAll(const TakePoint& put) {
    std::vector<LandmarkEstimate> map = initialiser_.filter().landmarks();
    const bool all = solve_.FailUnless(run_.ForEachFrame(e_, run_.shape().frames, put) &&
                                           (map.empty() || run_.PutMap(e_, solve_.u(), map)),
                                       run_);
    if (all) map_ = std::move(map);
    return all;
  }

  Mode mode_;
  SolveOptions options_;
  CondensedRun run_;
  MapSolve solve_;
  std::optional<SparseSolve> sparse_;  ///< once it is solved so
  std::optional<IncrementalSolve> incremental_;
  bool solved_so_ = false;  ///< the last frame, incrementally
  bool told_why_ = false;   ///< why it was not
  std::string at_edge_;     ///< what it said last of landmarks at the edge
  std::function<bool()> stop_;
  State state_;
  InitialisingFilter initialiser_;  ///< gives the trajectory to start from
  Trajectory filtered_;
  Eigen::VectorXd e_;
  std::vector<LandmarkEstimate> map_;
  UpdateReport report_;
  bool refused_ = false;  ///< a frame; there is nothing to go on with
};

constexpr EstimatorCapabilities kCapabilities = {
    .known = false, .from_measurement = true, .landmarks = true};

EstimatorMaker MakerOf(const BatchOptions& options) {
  return [options](const Problem& problem, const std::vector<StreamInfo>& streams) {
    ALIDADE_EXPECTS(!FindUnsupported(problem, kCapabilities) && !FindDefect(problem));
    return std::make_unique<CeresBatch>(problem, options, streams);
  };
}

EstimatorMaker Create(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  BatchOptions options;
  options.mode = static_cast<Mode>(
      p.Choice("mode", {"smoothing", "filtering", "incremental"},
               "data of an estimate: all frames, or those up to it; incremental: as filtering, but "
               "only what a frame changes is solved for again",
               0));
  if (options.mode == Mode::kIncremental) {
    options.relinearise_above =
        p.Positive("relinearise_above", "sigma",
                   "how far what is linearised may move until it is linearised anew", 0.03);
  }
  options.solve = ReadSolveOptions(p);
  options.solve.solver = SolverKind::kSparse;
  if (options.mode == Mode::kIncremental) return MakerOf(options);
  options.solve.solver = static_cast<SolverKind>(
      p.Choice("solver", {"auto", "sparse", "dense"},
               "system of an iteration; auto: sparse, but dense where there are few inputs", 0));
  return MakerOf(options);
}

}  // namespace
}  // namespace alidade::ceres_batch

ALIDADE_ESTIMATOR_PLUGIN(
    {"ceres_batch", "Maximum a posteriori of a whole run, by nonlinear least squares.",
     "[Bell1994]", &alidade::ceres_batch::Create, alidade::EstimatorKind::kBatch,
     &alidade::ceres_batch::kCapabilities},
    {"fixed_lag", "Maximum a posteriori of the last frames, by nonlinear least squares.",
     "[Sibley2010]", &alidade::ceres_batch::CreateFixedLag, alidade::EstimatorKind::kSlidingWindow,
     &alidade::ceres_batch::kFixedLagCapabilities})
