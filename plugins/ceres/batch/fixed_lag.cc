// SPDX-License-Identifier: Apache-2.0
#include "fixed_lag.h"

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "condensed_run.h"
#include "initialising_filter.h"
#include "map_solve.h"
#include "sparse_solve.h"

namespace alidade::ceres_batch {
namespace {

/// lag_s in whole ns; beyond what a Timestamp holds, no frame leaves the window.
Timestamp LagOf(double lag_s) {
  constexpr double kBeyond = 9e9;
  return lag_s < kBeyond ? TimestampFromSeconds(lag_s) : std::numeric_limits<Timestamp>::max();
}

/// Fixed-lag smoother: the maximum a posteriori of the frames of the last lag_s, of the factors
/// of CondensedRun, given a prior that holds all that came before.
///
///   window   frames j with t_k - t_j <= lag_s, k the newest
///   prior    x_0 = x^ (+) (d_0 + L_0 e_0), of the state at the last frame that left, and of the
///            landmarks that began in it or before
///
/// A frame that leaves is linearised at the last solution, and stays so: see
/// CondensedRun::MarginaliseFirst. On a linear system the window is the batch of the data so far.
/// With landmarks it is solved by SparseSolve, else by MapSolve: a window has few inputs.
///
/// Source       [Sibley2010].
class FixedLag : public Estimator {
 public:
  FixedLag(const Problem& problem, double lag_s, bool lagged, const SolveOptions& options,
           const std::vector<StreamInfo>& streams)
      : lag_(LagOf(lag_s)),
        lagged_(lagged),
        options_(options),
        run_(problem, streams, options.max_dt_s),
        solve_(options),
        state_(problem.InitialState(/*reserved=*/true)),
        initialiser_(problem, options.max_dt_s, streams) {}

  void Start(Timestamp timestamp) override {
    run_.Start(timestamp);
    initialiser_.filter().Start(timestamp);
  }
  bool offline() const override { return lagged_; }
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
    refused_ =
        !MoveWindow(frame.timestamp) || !run_.Add(frame, filter, initialiser_.filter(), about_);
    if (!refused_) SolveWindow(frame.timestamp);
    if (failed()) report_.events.push_back({frame.timestamp, EventKind::kNoSolution, WhyFailed()});
    initialiser_.AddReport(frame.timestamp, filter, report_.events);
    return report_;
  }

  /// Of the frames that left the window, then of those still in it.
  void Smooth(const Emit& emit) override {
    if (!failed()) refused_ = !Keep(run_.shape().frames);
    if (failed()) throw Error(ExitCode::kDiverged, WhyFailed());
    for (std::size_t k = 0; k < kept_.size(); ++k) emit(k, kept_[k].state, kept_[k].report);
  }

 private:
  /// The estimate of a frame when it left the window.
  struct Kept {
    State state;
    UpdateReport report;
  };

  const std::string& WhyFailed() const {
    if (refused_) return run_.problem();
    return sparse_ ? sparse_->summary() : solve_.summary();
  }

  bool Leaves(Timestamp timestamp, Timestamp newest) const {
    Timestamp age = 0;
    return __builtin_sub_overflow(newest, timestamp, &age) || age > lag_;
  }

  /// Lets go of the frames that are too old once there is one at `newest`.
  bool MoveWindow(Timestamp newest) {
    std::size_t leaving = 0;
    while (leaving < timestamps_.size() && Leaves(timestamps_[leaving], newest)) ++leaving;
    if (offline() && !Keep(leaving)) return false;
    for (std::size_t i = 0; i < leaving; ++i) {
      if (!run_.MarginaliseFirst(e_, map_, about_)) return false;
    }
    timestamps_.erase(timestamps_.begin(),
                      timestamps_.begin() + static_cast<std::ptrdiff_t>(leaving));
    return true;
  }

  /// Keeps the estimates of the first `count` frames of the window.
  bool Keep(std::size_t count) {
    return count == 0 || ForEachFrame([&](std::size_t k, const auto& x, const auto& covariance) {
             if (k >= count) return;
             Kept kept;
             run_.Put(k, x, covariance(), state_, kept.report);
             kept.state = state_;
             kept_.push_back(std::move(kept));
           });
  }

  /// Gives the estimates of the last solution, and makes its map.
  bool ForEachFrame(const SparseSolve::Take& take) {
    if (sparse_) return sparse_->PutAll(take, map_);
    return run_.ForEachFrame(e_, run_.shape().frames, [&](std::size_t k, const Point& point) {
      take(k, point.x, [&] { return CovarianceOf(point, solve_.u()); });
    });
  }

  /// The inputs become those of the solution. False, and WhyFailed, where there is none.
  bool Solve() {
    if (!run_.shape().has_landmarks) return solve_.SolveAnew(run_, about_, e_);
    map_ = initialiser_.filter().landmarks();
    sparse_.emplace(run_, options_);
    if (!sparse_->SolveAnew(about_, e_)) return false;
    e_ = sparse_->inputs();
    return true;
  }

  void SolveWindow(Timestamp timestamp) {
    timestamps_.push_back(run_.timestamp());
    if (!Solve()) return;
    about_.clear();
    const std::size_t frames = run_.shape().frames;
    const bool all = ForEachFrame([&](std::size_t k, const auto& x, const auto& covariance) {
      about_.push_back(x);
      if (!offline() && k + 1 == frames) run_.Put(k, x, covariance(), state_, report_);
    });
    if (sparse_) {
      sparse_->NoteNew(timestamp, at_edge_, report_.events);
    } else {
      solve_.FailUnless(all, run_);
      solve_.Note(timestamp, report_.events);
    }
  }

  Timestamp lag_;
  bool lagged_;  ///< the output, else current
  SolveOptions options_;
  CondensedRun run_;  ///< that of the window
  MapSolve solve_;
  std::optional<SparseSolve> sparse_;  ///< with landmarks: of the last window
  std::string at_edge_;                ///< what it said of landmarks at the edge of their domain
  State state_;  ///< current: of the last frame; lagged: of the last that left
  InitialisingFilter
      initialiser_;  ///< gives the newest frame a start, and blocks their first values
  std::vector<Timestamp> timestamps_;
  Trajectory about_;  ///< the last solution
  std::vector<Kept> kept_;
  std::vector<LandmarkEstimate> map_;
  Eigen::VectorXd e_;
  UpdateReport report_;
  bool refused_ = false;  ///< a frame, or to let go of one; there is nothing to go on with
};

}  // namespace

EstimatorMaker CreateFixedLag(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  const double lag_s = p.Positive("lag_s", "s", "age of the oldest frame that is smoothed");
  const int output = p.Choice(
      "output", {"current", "lagged"},
      "current: of each frame when it comes; lagged: when it leaves the window, at the end", 0);
  return [lag_s, lagged = output == 1, options = ReadSolveOptions(p)](
             const Problem& problem, const std::vector<StreamInfo>& streams) {
    ALIDADE_EXPECTS(!FindUnsupported(problem, kFixedLagCapabilities) && !FindDefect(problem));
    return std::make_unique<FixedLag>(problem, lag_s, lagged, options, streams);
  };
}

}  // namespace alidade::ceres_batch
