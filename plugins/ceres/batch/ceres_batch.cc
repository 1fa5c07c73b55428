// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "alidade/filter/support.h"
#include "alidade/host/cpp_plugin.h"
#include "condensed_run.h"
#include "fixed_lag.h"
#include "initialising_filter.h"
#include "map_solve.h"
#include "sparse_solve.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kManyInputs = 1000;         // of which a dense solve takes seconds
constexpr int kFewInputs = 200;           // of which it takes less than 0.1 s
constexpr int kMostInputs = 100'000'000;  // of a sparse solve, which SparseSolve may refuse before

/// Maximum a posteriori of all states given all data, or given the data so far (the
/// full-information filter): see CondensedRun for the problem, MapSolve and SparseSolve for its
/// solution.
class CeresBatch : public Estimator {
 public:
  CeresBatch(const System& system, bool smooths, const SolveOptions& options,
             const std::vector<StreamInfo>& streams)
      : smooths_(smooths),
        options_(options),
        run_(system, streams, options.max_dt_s, MayBeSparse() ? kMostInputs : kMostDenseInputs),
        solve_(options),
        state_(system.InitialState(/*reserved=*/true)),
        initialiser_(system, options.max_dt_s, streams) {}

  void Start(Timestamp timestamp) override {
    run_.Start(timestamp);
    initialiser_.filter().Start(timestamp);
  }
  bool offline() const override { return smooths_; }
  const State& state() const override { return state_; }
  std::vector<LandmarkEstimate> landmarks() const override { return map_; }
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
    if (failed()) report_.events.push_back({frame.timestamp, "no_solution", WhyFailed()});
    if (!refused_ && !MayBeSparse() && were_few && run_.shape().inputs > kManyInputs) {
      report_.events.push_back({frame.timestamp, "slow",
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
        report_.events.push_back({run_.timestamp(), "solution", WhyFailed()});
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
    return MayBeSparse() &&
           (options_.solver == SolverKind::kSparse || run_.shape().inputs > kFewInputs);
  }

  bool SmoothDense(const SparseSolve::Take& put) {
    return solve_.SolveAll(run_, filtered_, e_) && PutAll([&](std::size_t k, const Point& point) {
             put(k, point.x, [&] { return CovarianceOf(point, solve_.u()); });
           });
  }

  bool SmoothSparse(const SparseSolve::Take& put) {
    sparse_.emplace(run_, options_);
    sparse_->StopWhen(stop_);
    map_ = initialiser_.filter().landmarks();
    const bool again = !offline() && e_.size() > 0;
    return ((again && sparse_->SolveAnew(filtered_, e_)) || sparse_->SolveAll(filtered_)) &&
           sparse_->PutAll(put, map_);
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

  void SolveSoFar() {
    const std::size_t last = run_.shape().frames - 1;
    if (IsSparse()) {
      SmoothSparse([&](std::size_t k, const auto& x, const auto& covariance) {
        if (k == last) run_.Put(k, x, covariance(), state_, report_);
      });
      e_ = sparse_->inputs();
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
    map_ = initialiser_.filter().landmarks();
    return solve_.FailUnless(run_.ForEachFrame(e_, run_.shape().frames, put) &&
                                 (map_.empty() || run_.PutMap(e_, solve_.u(), map_)),
                             run_);
  }

  bool smooths_;
  SolveOptions options_;
  CondensedRun run_;
  MapSolve solve_;
  std::optional<SparseSolve> sparse_;  ///< once it is solved so
  std::string at_edge_;                ///< what it said last of landmarks at the edge
  std::function<bool()> stop_;
  State state_;
  InitialisingFilter initialiser_;  ///< gives the trajectory to start from
  Trajectory filtered_;
  Eigen::VectorXd e_;
  std::vector<LandmarkEstimate> map_;
  UpdateReport report_;
  bool refused_ = false;  ///< a frame; there is nothing to go on with
};

constexpr Support kSupport = {.known = false, .from_measurement = true, .landmarks = true};

EstimatorMaker Create(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  const bool smooths = p.Choice("mode", {"smoothing", "filtering"},
                                "data of an estimate: all frames, or those up to it", 0) == 0;
  SolveOptions options = ReadSolveOptions(p);
  options.solver = static_cast<SolverKind>(
      p.Choice("solver", {"auto", "sparse", "dense"},
               "system of an iteration; auto: sparse, but dense where there are few inputs", 0));
  return [smooths, options](const System& system, const std::vector<StreamInfo>& streams) {
    ALIDADE_EXPECTS(!FindUnsupported(system, kSupport));
    return std::make_unique<CeresBatch>(system, smooths, options, streams);
  };
}

}  // namespace
}  // namespace alidade::ceres_batch

ALIDADE_ESTIMATOR_PLUGIN(
    {"ceres_batch", "Maximum a posteriori of a whole run, by nonlinear least squares.",
     "[Bell1994]", &alidade::ceres_batch::Create, alidade::EstimatorKind::kBatch,
     &alidade::ceres_batch::kSupport},
    {"fixed_lag", "Maximum a posteriori of the last frames, by nonlinear least squares.",
     "[Sibley2010]", &alidade::ceres_batch::CreateFixedLag, alidade::EstimatorKind::kSlidingWindow,
     &alidade::ceres_batch::kFixedLagSupport})
