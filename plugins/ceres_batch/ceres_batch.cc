// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "alidade/build_plugin.h"
#include "companion.h"
#include "fixed_lag.h"
#include "map_solve.h"
#include "supported.h"
#include "trajectory.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kManyInputs = 1000;  // of which a solve takes seconds

struct Options {
  enum class Data { kAll, kSoFar } data = Data::kAll;
  MapSolve::Options solve;
  double max_dt_s = std::numeric_limits<double>::infinity();
  bool lent = false;  ///< it sees what another estimator accepted
};

/// Maximum a posteriori of all states given all data, or given the data so far (the
/// full-information filter): see Trajectory for the problem, MapSolve for its solution.
class CeresBatch : public Estimator {
 public:
  CeresBatch(const System& system, const Options& options, const std::vector<StreamInfo>& streams)
      : data_(options.data),
        trajectory_(system, streams, options.max_dt_s),
        solve_(options.solve),
        state_(system.InitialState()),
        companion_(FilterSystem(system, options), options.max_dt_s, streams) {}

  void Start(Stamp stamp) override {
    trajectory_.Start(stamp);
    companion_.filter().Start(stamp);
  }
  bool offline() const override { return data_ == Options::Data::kAll; }
  const State& state() const override { return state_; }
  std::vector<LandmarkEstimate> landmarks() const override { return map_; }
  Stamp stamp() const override { return trajectory_.stamp(); }
  bool diverged() const override { return failed_; }
  bool failed() const override { return failed_; }

  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    const Ekf& ekf = companion_.filter();
    const UpdateReport& filter = companion_.Process(frame);
    const bool were_few = trajectory_.inputs() <= kManyInputs;
    if (!trajectory_.Add(frame, filter, ekf)) {
      failed_ = true;
      report_.events.push_back({frame.stamp, "batch", trajectory_.problem()});
      return report_;
    }
    if (!ekf.failed()) filtered_.push_back(trajectory_.ValuesOf(ekf.state()));
    if (!offline()) SolveSoFar(frame.stamp);
    if (were_few && trajectory_.inputs() > kManyInputs) {
      report_.events.push_back({frame.stamp, "slow",
                                "more than " + std::to_string(kManyInputs) +
                                    " noise inputs: the time of a solve grows with their cube"});
    }
    companion_.Tell(frame.stamp, filter, report_.events);
    return report_;
  }

  void StopWhen(const std::function<bool()>& stop) override {
    if (offline()) solve_.StopWhen(stop);
  }

  void Smooth(const Emit& emit) override {
    if (trajectory_.size() == 0) return;
    if (!trajectory_.Linearised(filtered_, e_) || !CanStart()) {
      e_.setZero(trajectory_.inputs());
      if (!CanStart()) FailAll("the batch has nowhere to start: " + trajectory_.problem());
    }
    solve_.Solve(trajectory_, e_);
    const auto put = [&](std::size_t k, const Trajectory::Point& point) {
      solve_.HeedStop();
      const bool last = k + 1 == trajectory_.size();
      trajectory_.Report(k, point, report_);
      PutState(k, point);
      if (last) report_.events.push_back({trajectory_.stamp(), "batch", solve_.summary()});
      emit(k, state_, report_);
    };
    map_ = companion_.filter().landmarks();
    const bool put_all = Covariances() && ForEachFrame(put) && PutMap();
    if (!put_all) FailAll(solve_.summary() + "; then " + trajectory_.problem());
  }

 private:
  /// A landmark that another estimator let enter has waited long enough.
  static System FilterSystem(System system, const Options& options) {
    if (system.landmarks && options.lent) system.landmarks->enter_after = 1;
    return system;
  }
  [[noreturn]] void FailAll(const std::string& why) {
    failed_ = true;
    throw Error(ExitCode::kDiverged, why);
  }

  /// Freezes at e_; false where a model is not defined there.
  bool CanStart() { return MapSolve::CanStart(trajectory_, e_); }

  /// Starts where the frame before ended, its new inputs at their mean.
  void SolveSoFar(Stamp stamp) {
    const Eigen::Index before = e_.size();
    e_.conservativeResize(trajectory_.inputs());
    e_.tail(e_.size() - before).setZero();
    const bool old = !trajectory_.turns() && CanStart();
    if (!old && !(trajectory_.Linearised(filtered_, e_) && CanStart())) {
      NoteFailure(stamp, "the batch has nowhere to start: " + trajectory_.problem());
      return;
    }
    solve_.Solve(trajectory_, e_);
    const auto put = [&](std::size_t k, const Trajectory::Point& point) {
      if (k + 1 < trajectory_.size()) return;
      trajectory_.Report(k, point, report_);
      PutState(k, point);
    };
    map_ = companion_.filter().landmarks();
    if (!Covariances() || !ForEachFrame(put) || !PutMap()) {
      NoteFailure(stamp, solve_.summary() + "; then " + trajectory_.problem());
    } else if (failed_) {
      NoteFailure(stamp, solve_.summary());
    }
  }

  void NoteFailure(Stamp stamp, const std::string& why) {
    failed_ = true;
    report_.events.push_back({stamp, "batch", why});
  }

  bool Covariances() {
    const bool good = solve_.Covariances(trajectory_, e_);
    failed_ = solve_.failed();
    return good;
  }

  /// The points of e_, frame by frame; false where a model is not defined, which ends it.
  template <class Take>
  bool ForEachFrame(const Take& take) {
    Trajectory::Point point;
    bool good = trajectory_.Begin(e_.data(), true, point);
    for (std::size_t k = 0; k < trajectory_.size() && good; ++k) {
      good = trajectory_.Advance(k, e_.data(), point);
      if (good) take(k, point);
    }
    return good;
  }

  bool PutMap() { return map_.empty() || trajectory_.PutMap(e_.data(), solve_.u(), map_); }

  void PutState(std::size_t k, const Trajectory::Point& point) {
    trajectory_.Put(k, point, solve_.Whitened(point), state_);
  }

  Options::Data data_;
  Trajectory trajectory_;
  MapSolve solve_;
  State state_;
  Companion companion_;  ///< gives the trajectory to start from
  std::vector<std::vector<double>> filtered_;
  Eigen::VectorXd e_;
  std::vector<LandmarkEstimate> map_;
  UpdateReport report_;
  bool failed_ = false;
};

constexpr Support kSupport = {.held = false, .from_measurement = true, .landmarks = true};

EstimatorMaker Create(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  Options options;
  options.data = static_cast<Options::Data>(
      p.Choice("data", {"all", "so_far"}, "what an estimate sees: all frames, or none later", 0));
  options.solve.max_iterations =
      p.Integer("max_iterations", "of one solve", 1, 1'000'000, options.solve.max_iterations);
  options.solve.max_outer_iterations =
      p.Integer("max_outer_iterations", "solves, with noise that depends on the state taken anew",
                1, 1'000'000, options.solve.max_outer_iterations);
  options.max_dt_s =
      p.Positive("max_dt_s", "s", "longer gaps are stepped in equal parts", options.max_dt_s);
  const auto use = arguments.entry.Find("use");
  options.lent = use && use->is_map();
  return [options, entry = arguments.entry](const System& system,
                                            const std::vector<StreamInfo>& streams) {
    CheckSupported(system, entry, "ceres_batch", kSupport);
    return std::make_unique<CeresBatch>(system, options, streams);
  };
}

}  // namespace
}  // namespace alidade::ceres_batch

ALIDADE_ESTIMATOR_PLUGIN({"ceres_batch",
                          "Maximum a posteriori of a whole run, by nonlinear least squares.",
                          "[Bell1994]", &alidade::ceres_batch::Create, true},
                         {"fixed_lag",
                          "Maximum a posteriori of the last frames, by nonlinear least squares.",
                          "[Sibley2010]", &alidade::ceres_batch::CreateFixedLag})
