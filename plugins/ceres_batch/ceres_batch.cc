// SPDX-License-Identifier: Apache-2.0
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <iterator>
#include <limits>
#include <locale>
#include <sstream>

#include "alidade/build_plugin.h"
#include "alidade/ekf.h"
#include "alidade/support.h"
#include "fixed_lag.h"
#include "frozen_solve.h"
#include "trajectory.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kManyInputs = 1000;  // of which a solve takes seconds

struct Options {
  enum class Data { kAll, kSoFar } data = Data::kAll;
  int max_iterations = 50;
  int max_outer_iterations = 20;
  double max_dt_s = std::numeric_limits<double>::infinity();
  bool lent = false;  ///< it sees what another estimator accepted
};

/// Maximum a posteriori of all states given all data, or given the data so far (the
/// full-information filter): see Trajectory for the problem.
///
/// Q and R that depend on the state are frozen, the problem is solved, and so on until they settle.
/// With [I; sqrt(w) J_r_e] = Q U at the solution, where w are the weights of robust losses, 1
/// without, Cov(e) = (U'U)^-1 and P_k = (U^-T S_k')'(U^-T S_k').
class CeresBatch : public Estimator {
 public:
  CeresBatch(const System& system, const Options& options, const std::vector<StreamInfo>& streams)
      : options_(options),
        trajectory_(system, streams, options.max_dt_s),
        state_(system.InitialState()),
        filter_(FilterSystem(system, options), FilterOptions(options), streams) {}

  void Start(Stamp stamp) override {
    trajectory_.Start(stamp);
    filter_.Start(stamp);
  }
  bool offline() const override { return options_.data == Options::Data::kAll; }
  const State& state() const override { return state_; }
  std::vector<LandmarkEstimate> landmarks() const override { return map_; }
  Stamp stamp() const override { return trajectory_.stamp(); }
  bool diverged() const override { return failed_; }
  bool failed() const override { return failed_; }

  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    const bool had_failed = filter_.failed();
    const UpdateReport& filter = filter_.Process(frame);
    const bool were_few = trajectory_.inputs() <= kManyInputs;
    if (!trajectory_.Add(frame, filter, filter_)) {
      failed_ = true;
      report_.events.push_back({frame.stamp, "batch", trajectory_.problem()});
      return report_;
    }
    if (!filter_.failed()) filtered_.push_back(trajectory_.ValuesOf(filter_.state()));
    if (!offline()) SolveSoFar(frame.stamp);
    if (were_few && trajectory_.inputs() > kManyInputs) {
      report_.events.push_back({frame.stamp, "slow",
                                "more than " + std::to_string(kManyInputs) +
                                    " noise inputs: the time of a solve grows with their cube"});
    }
    std::ranges::copy_if(filter.events, std::back_inserter(report_.events), TellsOfTheData);
    if (filter_.failed() && !had_failed) NoteFilter(frame.stamp, filter);
    return report_;
  }

  void StopWhen(const std::function<bool()>& stop) override { stop_ = stop; }

  void Smooth(const Emit& emit) override {
    if (trajectory_.size() == 0) return;
    if (!trajectory_.Linearised(filtered_, e_) || !CanStart()) {
      e_.setZero(trajectory_.inputs());
      if (!CanStart()) FailAll("the batch has nowhere to start: " + trajectory_.problem());
    }
    Solve();
    const auto put = [&](std::size_t k, const Trajectory::Point& point) {
      HeedStop();
      const bool last = k + 1 == trajectory_.size();
      trajectory_.Report(k, point, report_);
      PutState(k, point);
      if (last) report_.events.push_back({trajectory_.stamp(), "batch", summary_});
      emit(k, state_, report_);
    };
    map_ = filter_.landmarks();
    if (!Covariances() || !ForEachFrame(put) || !PutMap()) {
      FailAll(summary_ + "; then " + trajectory_.problem());
    }
  }

 private:
  /// Whether an event of the filter that goes along is one of the batch too.
  static bool TellsOfTheData(const Event& event) {
    return event.kind == "input_stale" || event.kind == "input_refused" || event.kind == "substeps";
  }
  /// Tells why the filter that goes along ended.
  void NoteFilter(Stamp stamp, const UpdateReport& filter) {
    const auto cause = std::ranges::find(filter.events, true, &Event::divergence);
    report_.events.push_back({stamp, "start",
                              "the filter that the batch starts from, and that gives blocks their "
                              "first values, ended" +
                                  (cause == filter.events.end() ? "" : ": " + cause->text)});
  }
  /// A landmark that another estimator let enter has waited long enough.
  static System FilterSystem(System system, const Options& options) {
    if (system.landmarks && options.lent) system.landmarks->enter_after = 1;
    return system;
  }
  static EkfOptions FilterOptions(const Options& options) {
    EkfOptions filter;
    filter.lockout = Lockout::kNone;
    filter.max_dt_s = options.max_dt_s;
    return filter;
  }

  [[noreturn]] void FailAll(const std::string& why) {
    failed_ = true;
    throw Error(ExitCode::kDiverged, why);
  }

  bool Stopped() const { return offline() && stop_ && stop_(); }
  void HeedStop() const {
    if (Stopped()) throw Error(ExitCode::kStopped, "stopped while the batch was solved");
  }

  /// Freezes at e_; false where a model is not defined there.
  bool CanStart() { return trajectory_.Freeze(e_.data()) && IsDefined(trajectory_, e_); }

  /// Starts where the frame before ended, its new inputs at their mean.
  void SolveSoFar(Stamp stamp) {
    const Eigen::Index before = e_.size();
    e_.conservativeResize(trajectory_.inputs());
    e_.tail(e_.size() - before).setZero();
    const bool old = !trajectory_.turns() && CanStart();
    if (old || (trajectory_.Linearised(filtered_, e_) && CanStart())) {
      Solve();
      const auto put = [&](std::size_t k, const Trajectory::Point& point) {
        if (k + 1 < trajectory_.size()) return;
        trajectory_.Report(k, point, report_);
        PutState(k, point);
      };
      map_ = filter_.landmarks();
      if (!Covariances() || !ForEachFrame(put) || !PutMap()) {
        failed_ = true;
        summary_ += "; then " + trajectory_.problem();
      }
    } else {
      failed_ = true;
      summary_ = "the batch has nowhere to start: " + trajectory_.problem();
    }
    if (failed_) report_.events.push_back({stamp, "batch", summary_});
  }

  /// Solves from e_, at which Q and R are frozen, until they settle.
  void Solve() {
    constexpr double kSettled = 1e-9;
    int iterations = 0, outer = 0;
    bool settled = false;
    std::string why = "the noise that depends on the state did not settle; a larger " +
                      Setting("max_outer_iterations", options_.max_outer_iterations) + " may do";
    ceres::Solver::Summary summary;
    do {
      HeedStop();
      summary = SolveFrozen(trajectory_, e_, options_.max_iterations, [this] { return Stopped(); });
      HeedStop();
      iterations += static_cast<int>(summary.iterations.size()) - 1;
      ++outer;
      failed_ =
          summary.termination_type != ceres::CONVERGENCE || !std::isfinite(summary.final_cost);
      if (failed_) why = WhyNot(summary);
      if (!failed_ && trajectory_.robust()) iterations += Reweight();
      if (failed_) break;
      if (!trajectory_.Freeze(e_.data())) {
        why = trajectory_.problem();
        break;
      }
      settled = trajectory_.change() <= kSettled;
    } while (!settled && outer < options_.max_outer_iterations);
    failed_ = failed_ || !settled;
    cost_ = summary.final_cost;
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << "cost " << std::setprecision(9) << cost_ << ", " << iterations << " iterations in "
         << outer << (outer == 1 ? " solve: " : " solves: ");
    summary_ = text.str();
    if (failed_) summary_ += why;
  }

  /// `key (50 here)`
  static std::string Setting(const char* key, int value) {
    return std::string(key) + " (" + std::to_string(value) + " here)";
  }

  std::string WhyNot(const ceres::Solver::Summary& summary) const {
    if (!std::isfinite(summary.final_cost)) {
      return "not converged, the cost is not finite: a measurement lies too far out; `use: "
             "{accepted_by: FILTER}` leaves out what a filter gates";
    }
    const bool by_count = summary.termination_type == ceres::NO_CONVERGENCE;
    return "not converged, " + summary.message +
           (by_count
                ? " A larger " + Setting("max_iterations", options_.max_iterations) + " may do."
                : "");
  }

  /// U at e_, and the Gauss-Newton step that it gives: Ceres stops before the last one. A solver
  /// that stopped where this step, |U step| sigmas, is long was not led down by the Jacobian that
  /// it was given. False where a model is not defined.
  bool Covariances() {
    constexpr double kLong = 1e-3, kRounding = 1e-6;
    Eigen::VectorXd step;
    HeedStop();
    if (!GaussNewton(trajectory_, e_, u_, step)) return false;
    if (failed_) return true;
    failed_ = !((u_ * step).norm() <= kLong + kRounding * std::sqrt(2.0 * cost_));
    if (failed_) {
      summary_ +=
          "not converged: no step lowers the cost although the gradient is not zero; check the "
          "models' Jacobians with alidade check";
    } else {
      summary_ += "converged";
      e_ += step;
      if (trajectory_.has_landmarks()) return IsDefined(trajectory_, e_);
    }
    return true;
  }

  /// Reweighted least squares converges linearly where the squared error does so quadratically:
  /// what is left below Ceres' tolerances counts. How many steps it took.
  int Reweight() {
    // Of inputs whose sigma is 1; with landmarks a step takes longer.
    const double settled = trajectory_.has_landmarks() ? 1e-6 : 1e-10;
    Eigen::VectorXd step;
    int steps = 0;
    do {
      HeedStop();
      if (!GaussNewton(trajectory_, e_, u_, step)) return steps;
      e_ += step;
      ++steps;
    } while (step.norm() > settled && steps < options_.max_iterations);
    return steps;
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

  bool PutMap() { return map_.empty() || trajectory_.PutMap(e_.data(), u_, map_); }

  void PutState(std::size_t k, const Trajectory::Point& point) {
    trajectory_.Put(
        k, point, u_.transpose().triangularView<Eigen::Lower>().solve(point.s.transpose()), state_);
  }

  Options options_;
  Trajectory trajectory_;
  State state_;
  Ekf filter_;  ///< gives the trajectory to start from
  std::vector<std::vector<double>> filtered_;
  Eigen::VectorXd e_;
  Eigen::MatrixXd u_;
  std::vector<LandmarkEstimate> map_;
  UpdateReport report_;
  std::string summary_;
  std::function<bool()> stop_;
  double cost_ = 0.0;  ///< of the last solve
  bool failed_ = false;
};

constexpr Support kSupport = {.held = false, .from_measurement = true, .landmarks = true};

/// Where a config asks for what is not supported: `sensors.stereo.roles.depth.mode`.
std::string KeyOf(const Unsupported& asked, const System& system) {
  if (asked.block >= 0) {
    const Block& block = system.layout[asked.block];
    return "state." + block.owner + ".consider names '" + block.name + "'";
  }
  if (asked.sensor < 0) return "landmarks";
  const SensorBinding& sensor = system.sensors[static_cast<std::size_t>(asked.sensor)];
  const auto role = static_cast<std::size_t>(asked.role);
  return "sensors." + sensor.name + ".roles." + sensor.model.roles()[role].name +
         (asked.what.starts_with("linearise_at") ? ".linearise_at" : ".mode");
}

/// Refuses what a batch cannot do, by name.
void CheckSupported(const System& system, const Node& entry) {
  const auto asked = FindUnsupported(system, kSupport);
  if (!asked) return;
  entry.Fail(
      "estimator type 'ceres_batch' does not support " + asked->what + ": " + KeyOf(*asked, system),
      asked->remedy + " (also by the estimator's `overrides`), or type: ekf");
}

EstimatorMaker Create(const EstimatorArguments& arguments) {
  Params& p = arguments.params;
  Options options;
  options.data = static_cast<Options::Data>(
      p.Choice("data", {"all", "so_far"}, "what an estimate sees: all frames, or none later", 0));
  options.max_iterations =
      p.Integer("max_iterations", "of one solve", 1, 1'000'000, options.max_iterations);
  options.max_outer_iterations =
      p.Integer("max_outer_iterations", "solves, with noise that depends on the state taken anew",
                1, 1'000'000, options.max_outer_iterations);
  options.max_dt_s =
      p.Positive("max_dt_s", "s", "longer gaps are stepped in equal parts", options.max_dt_s);
  const auto use = arguments.entry.Find("use");
  options.lent = use && use->is_map();
  return [options, entry = arguments.entry](const System& system,
                                            const std::vector<StreamInfo>& streams) {
    CheckSupported(system, entry);
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
