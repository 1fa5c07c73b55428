// SPDX-License-Identifier: Apache-2.0
#include "fixed_lag.h"

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "condensed_run.h"
#include "initialising_filter.h"
#include "map_solve.h"
#include "supported.h"

namespace alidade::ceres_batch {
namespace {

/// No known roles, consider blocks, roles linearised at the measurement, landmarks.
constexpr Support kFixedLagSupport = {.known = false, .from_measurement = true};

struct FixedLagOptions {
  enum class Output { kCurrent, kLagged } output = Output::kCurrent;
  double lag_s = 0.0;
  SolveOptions solve;
};

/// lag_s in whole ns; beyond what a Timestamp holds, no frame leaves the window.
Timestamp LagOf(double lag_s) {
  constexpr double kBeyond = 9e9;
  return lag_s < kBeyond ? TimestampFromSeconds(lag_s) : std::numeric_limits<Timestamp>::max();
}

/// Fixed-lag smoother: the maximum a posteriori of the frames of the last lag_s, of the factors
/// of CondensedRun, given a prior that holds all that came before.
///
///   window   frames j with t_k - t_j <= lag_s, k the newest
///   prior    x_0 = x^ (+) (d_0 + L_0 e_0), of the state at the last frame that left
///
/// A frame that leaves is linearised at the last solution, and stays so: see
/// CondensedRun::MarginaliseFirst. On a linear problem the window is the batch of the data so far.
///
/// Source       [Sibley2010].
class FixedLag : public Estimator {
 public:
  FixedLag(const System& system, const FixedLagOptions& options,
           const std::vector<StreamInfo>& streams)
      : output_(options.output),
        window_(LagOf(options.lag_s)),
        run_(system, streams, options.solve.max_dt_s),
        solve_(options.solve),
        state_(system.InitialState(/*reserved=*/true)),
        initialiser_(system, options.solve.max_dt_s, streams) {}

  void Start(Timestamp timestamp) override {
    run_.Start(timestamp);
    initialiser_.filter().Start(timestamp);
  }
  bool offline() const override { return output_ == FixedLagOptions::Output::kLagged; }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return run_.timestamp(); }
  bool diverged() const override { return failed_; }
  bool failed() const override { return failed_; }

  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    if (failed_) return report_;
    const UpdateReport& filter = initialiser_.Process(frame);
    if (!MoveWindow(frame.timestamp) || !run_.Add(frame, filter, initialiser_.filter())) {
      Fail(frame.timestamp, run_.problem());
      initialiser_.AddReport(frame.timestamp, filter, report_.events);
      return report_;
    }
    timestamps_.push_back(run_.timestamp());
    if (!initialiser_.filter().failed()) {
      about_.push_back(run_.ValuesOf(initialiser_.filter().state()));
    }
    SolveWindow(frame.timestamp);
    initialiser_.AddReport(frame.timestamp, filter, report_.events);
    return report_;
  }

  /// Of the frames that left the window, then of those still in it.
  void Smooth(const Emit& emit) override {
    if (failed_) throw Error(ExitCode::kDiverged, why_);
    if (!Keep(run_.size())) {
      failed_ = true;
      throw Error(ExitCode::kDiverged, run_.problem());
    }
    for (std::size_t k = 0; k < kept_.size(); ++k) emit(k, kept_[k].state, kept_[k].report);
  }

 private:
  /// The estimate of a frame when it left the window.
  struct Kept {
    State state;
    UpdateReport report;
  };

  void Fail(Timestamp timestamp, const std::string& why) {
    failed_ = true;
    why_ = why;
    report_.events.push_back({timestamp, "no_solution", why});
  }

  bool Leaves(Timestamp timestamp, Timestamp newest) const {
    Timestamp age = 0;
    return __builtin_sub_overflow(newest, timestamp, &age) || age > window_;
  }

  /// Lets go of the frames that are too old once there is one at `newest`.
  bool MoveWindow(Timestamp newest) {
    std::size_t leaving = 0;
    while (leaving < timestamps_.size() && Leaves(timestamps_[leaving], newest)) ++leaving;
    if (offline() && !Keep(leaving)) return false;
    for (std::size_t i = 0; i < leaving; ++i) {
      if (!run_.MarginaliseFirst(e_)) return false;
    }
    const auto count = static_cast<std::ptrdiff_t>(leaving);
    timestamps_.erase(timestamps_.begin(), timestamps_.begin() + count);
    about_.erase(about_.begin(), about_.begin() + count);
    return true;
  }

  /// Keeps the estimates of the first `count` frames of the window.
  bool Keep(std::size_t count) {
    return run_.ForEachFrame(e_, count, [&](std::size_t k, const CondensedRun::Point& point) {
      Kept kept;
      run_.Report(k, point, kept.report);
      run_.Put(k, point, solve_.Whitened(point), state_);
      kept.state = state_;
      kept_.push_back(std::move(kept));
    });
  }

  void SolveWindow(Timestamp timestamp) {
    if (!solve_.SolveAnew(run_, about_, e_)) {
      Fail(timestamp, solve_.summary());
      return;
    }
    about_.clear();
    const bool good =
        run_.ForEachFrame(e_, run_.size(), [&](std::size_t k, const CondensedRun::Point& point) {
          about_.push_back(point.x);
          if (offline() || k + 1 < run_.size()) return;
          run_.Report(k, point, report_);
          run_.Put(k, point, solve_.Whitened(point), state_);
        });
    solve_.Note(timestamp, report_.events);
    if (!good) {
      Fail(timestamp, solve_.summary() + "; then " + run_.problem());
    } else if (solve_.failed()) {
      Fail(timestamp, solve_.summary());
    }
  }

  FixedLagOptions::Output output_;
  Timestamp window_;
  CondensedRun run_;  ///< that of the window
  MapSolve solve_;
  State state_;  ///< current: of the last frame; lagged: of the last that left
  InitialisingFilter
      initialiser_;  ///< gives the newest frame a start, and blocks their first values
  std::vector<Timestamp> timestamps_;
  std::vector<std::vector<double>> about_;  ///< the last solution
  std::vector<Kept> kept_;
  Eigen::VectorXd e_;
  UpdateReport report_;
  bool failed_ = false;
  std::string why_;
};

}  // namespace

EstimatorMaker CreateFixedLag(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  FixedLagOptions options;
  options.lag_s = p.Positive("lag_s", "s", "age of the oldest frame that is smoothed");
  options.output = static_cast<FixedLagOptions::Output>(p.Choice(
      "output", {"current", "lagged"},
      "current: of each frame when it comes; lagged: when it leaves the window, at the end", 0));
  options.solve = ReadSolveOptions(p);
  return [options, entry = arguments.entry](const System& system,
                                            const std::vector<StreamInfo>& streams) {
    CheckSupported(system, entry, "fixed_lag", kFixedLagSupport);
    return std::make_unique<FixedLag>(system, options, streams);
  };
}

}  // namespace alidade::ceres_batch
