// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <string>
#include <vector>

#include "alidade/host/cpp_plugin.h"
#include "condensed_run.h"
#include "fixed_lag.h"
#include "initialising_filter.h"
#include "map_solve.h"
#include "supported.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kManyInputs = 1000;  // of which a solve takes seconds

struct Options {
  enum class Mode { kSmoothing, kFiltering } mode = Mode::kSmoothing;
  SolveOptions solve;
};

/// Maximum a posteriori of all states given all data, or given the data so far (the
/// full-information filter): see CondensedRun for the problem, MapSolve for its solution.
class CeresBatch : public Estimator {
 public:
  CeresBatch(const System& system, const Options& options, const std::vector<StreamInfo>& streams)
      : mode_(options.mode),
        run_(system, streams, options.solve.max_dt_s),
        solve_(options.solve),
        state_(system.InitialState(/*reserved=*/true)),
        initialiser_(system, options.solve.max_dt_s, streams) {}

  void Start(Timestamp timestamp) override {
    run_.Start(timestamp);
    initialiser_.filter().Start(timestamp);
  }
  bool offline() const override { return mode_ == Options::Mode::kSmoothing; }
  const State& state() const override { return state_; }
  std::vector<LandmarkEstimate> landmarks() const override { return map_; }
  Timestamp timestamp() const override { return run_.timestamp(); }
  bool diverged() const override { return failed_; }
  bool failed() const override { return failed_; }

  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    if (refused_) return report_;
    const Ekf& ekf = initialiser_.filter();
    const UpdateReport& filter = initialiser_.Process(frame);
    const bool were_few = run_.inputs() <= kManyInputs;
    if (!run_.Add(frame, filter, ekf)) {
      refused_ = true;
      NoteFailure(frame.timestamp, run_.problem());
      initialiser_.AddReport(frame.timestamp, filter, report_.events);
      return report_;
    }
    if (!ekf.failed()) filtered_.push_back(run_.ValuesOf(ekf.state()));
    if (!offline()) SolveSoFar(frame.timestamp);
    if (were_few && run_.inputs() > kManyInputs) {
      report_.events.push_back({frame.timestamp, "slow",
                                "more than " + std::to_string(kManyInputs) +
                                    " noise inputs: the time of a solve grows with their cube"});
    }
    initialiser_.AddReport(frame.timestamp, filter, report_.events);
    return report_;
  }

  void StopWhen(const std::function<bool()>& stop) override {
    if (offline()) solve_.StopWhen(stop);
  }

  void Smooth(const Emit& emit) override {
    if (refused_) FailAll(run_.problem());
    if (run_.size() == 0) return;
    const bool solved = solve_.SolveAll(run_, filtered_, e_);
    failed_ = solve_.failed();
    if (!solved) FailAll(solve_.summary());
    const auto put = [&](std::size_t k, const CondensedRun::Point& point) {
      solve_.HeedStop();
      const bool last = k + 1 == run_.size();
      run_.Report(k, point, report_);
      PutState(k, point);
      if (last) solve_.Note(run_.timestamp(), report_.events);
      if (last) report_.events.push_back({run_.timestamp(), "solution", solve_.summary()});
      emit(k, state_, report_);
    };
    map_ = initialiser_.filter().landmarks();
    if (!run_.ForEachFrame(e_, run_.size(), put) || !PutMap()) {
      FailAll(solve_.summary() + "; then " + run_.problem());
    }
  }

 private:
  [[noreturn]] void FailAll(const std::string& why) {
    failed_ = true;
    throw Error(ExitCode::kDiverged, why);
  }

  void SolveSoFar(Timestamp timestamp) {
    const bool solved = solve_.SolveAnew(run_, filtered_, e_);
    failed_ = solve_.failed();
    if (!solved) {
      NoteFailure(timestamp, solve_.summary());
      return;
    }
    const auto put = [&](std::size_t k, const CondensedRun::Point& point) {
      if (k + 1 < run_.size()) return;
      run_.Report(k, point, report_);
      PutState(k, point);
    };
    map_ = initialiser_.filter().landmarks();
    const bool put_all = run_.ForEachFrame(e_, run_.size(), put) && PutMap();
    solve_.Note(timestamp, report_.events);
    if (!put_all) {
      NoteFailure(timestamp, solve_.summary() + "; then " + run_.problem());
    } else if (failed_) {
      NoteFailure(timestamp, solve_.summary());
    }
  }

  void NoteFailure(Timestamp timestamp, const std::string& why) {
    failed_ = true;
    report_.events.push_back({timestamp, "no_solution", why});
  }

  bool PutMap() { return map_.empty() || run_.PutMap(e_.data(), solve_.u(), map_); }

  void PutState(std::size_t k, const CondensedRun::Point& point) {
    run_.Put(k, point, solve_.Whitened(point), state_);
  }

  Options::Mode mode_;
  CondensedRun run_;
  MapSolve solve_;
  State state_;
  InitialisingFilter initialiser_;  ///< gives the trajectory to start from
  std::vector<std::vector<double>> filtered_;
  Eigen::VectorXd e_;
  std::vector<LandmarkEstimate> map_;
  UpdateReport report_;
  bool failed_ = false;
  bool refused_ = false;  ///< a frame; there is nothing to go on with
};

constexpr Support kSupport = {.known = false, .from_measurement = true, .landmarks = true};

EstimatorMaker Create(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  Options options;
  options.mode = static_cast<Options::Mode>(p.Choice(
      "mode", {"smoothing", "filtering"}, "data of an estimate: all frames, or those up to it", 0));
  options.solve = ReadSolveOptions(p);
  return [options, entry = arguments.entry](const System& system,
                                            const std::vector<StreamInfo>& streams) {
    CheckSupported(system, entry, "ceres_batch", kSupport);
    return std::make_unique<CeresBatch>(system, options, streams);
  };
}

}  // namespace
}  // namespace alidade::ceres_batch

ALIDADE_ESTIMATOR_PLUGIN(
    {"ceres_batch", "Maximum a posteriori of a whole run, by nonlinear least squares.",
     "[Bell1994]", &alidade::ceres_batch::Create, alidade::EstimatorKind::kBatch, true},
    {"fixed_lag", "Maximum a posteriori of the last frames, by nonlinear least squares.",
     "[Sibley2010]", &alidade::ceres_batch::CreateFixedLag, alidade::EstimatorKind::kSlidingWindow})
