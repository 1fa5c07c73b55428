// SPDX-License-Identifier: Apache-2.0
#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/QR>
#include <cstdio>
#include <limits>

#include "alidade/build_plugin.h"
#include "alidade/ekf.h"
#include "trajectory.h"

namespace alidade::ceres_batch {
namespace {

struct Options {
  enum class Data { kAll, kSoFar } data = Data::kAll;
  int max_iterations = 50;
  int max_outer_iterations = 20;
  double max_dt_s = std::numeric_limits<double>::infinity();
};

/// r(e) of a trajectory, with its Jacobian.
class Residuals : public ceres::CostFunction {
 public:
  explicit Residuals(const Trajectory& trajectory) : trajectory_(trajectory) {
    set_num_residuals(trajectory.residuals());
    mutable_parameter_block_sizes()->push_back(trajectory.inputs());
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    return trajectory_.Evaluate(parameters[0], residuals,
                                jacobians == nullptr ? nullptr : jacobians[0]);
  }

 private:
  const Trajectory& trajectory_;
};

/// Maximum a posteriori of all states given all data, or given the data so far (the
/// full-information filter): see Trajectory for the problem.
///
/// Q and R that depend on the state are frozen, the problem is solved, and so on until they settle.
/// With [I; J_r_e] = Q U at the solution, Cov(e) = (U'U)^-1 and P_k = (U^-T S_k')'(U^-T S_k').
class CeresBatch : public Estimator {
 public:
  CeresBatch(const System& system, const Options& options, const std::vector<StreamInfo>& streams)
      : options_(options),
        trajectory_(system, streams, options.max_dt_s),
        state_(system.InitialState()),
        filter_(system, FilterOptions(options), streams) {}

  void Start(Stamp) override {}  // the first frame, or start_s, says when
  bool offline() const override { return options_.data == Options::Data::kAll; }
  const State& state() const override { return state_; }
  Stamp stamp() const override { return trajectory_.stamp(); }
  bool diverged() const override { return failed_; }
  bool failed() const override { return failed_; }

  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    const UpdateReport& filter = filter_.Process(frame);
    if (!trajectory_.Add(frame, filter)) {
      failed_ = true;
      report_.events.push_back({frame.stamp, "batch", trajectory_.problem()});
      return report_;
    }
    if (!filter_.failed()) filtered_.push_back(trajectory_.ValuesOf(filter_.state()));
    if (!offline()) SolveSoFar(frame.stamp);
    return report_;
  }

  void Smooth(const Emit& emit) override {
    if (trajectory_.size() == 0) return;
    if (!trajectory_.Linearised(filtered_, e_) || !IsStart()) {
      e_.setZero(trajectory_.inputs());
      if (!IsStart()) {
        failed_ = true;
        throw Error(ExitCode::kDiverged,
                    "the batch has nowhere to start: " + trajectory_.problem());
      }
    }
    Solve();
    Covariances();
    Each([&](std::size_t k, const Trajectory::Point& point) {
      const bool last = k + 1 == trajectory_.size();
      trajectory_.Report(k, point, report_);
      PutState(k, point);
      if (last) report_.events.push_back({trajectory_.stamp(), "batch", summary_});
      emit(k, state_, report_);
    });
  }

 private:
  static EkfOptions FilterOptions(const Options& options) {
    EkfOptions filter;
    filter.lockout = Lockout::kNone;
    filter.max_dt_s = options.max_dt_s;
    return filter;
  }

  /// Freezes at e_; false where a model is not defined there.
  bool IsStart() {
    Eigen::VectorXd r(trajectory_.residuals());
    RowMajor j(r.size(), trajectory_.inputs());
    return trajectory_.Freeze(e_.data()) && trajectory_.Evaluate(e_.data(), r.data(), j.data());
  }

  /// Starts where the frame before ended, its new inputs at their mean.
  void SolveSoFar(Stamp stamp) {
    const Eigen::Index before = e_.size();
    e_.conservativeResize(trajectory_.inputs());
    e_.tail(e_.size() - before).setZero();
    if (IsStart() || (trajectory_.Linearised(filtered_, e_) && IsStart())) {
      Solve();
      Covariances();
      Each([&](std::size_t k, const Trajectory::Point& point) {
        if (k + 1 < trajectory_.size()) return;
        trajectory_.Report(k, point, report_);
        PutState(k, point);
      });
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
    ceres::Solver::Summary summary;
    do {
      summary = SolveFrozen();
      iterations += static_cast<int>(summary.iterations.size()) - 1;
      ++outer;
      failed_ = summary.termination_type != ceres::CONVERGENCE;
      if (failed_ || !trajectory_.Freeze(e_.data())) break;
      settled = trajectory_.change() <= kSettled;
    } while (!settled && outer < options_.max_outer_iterations);
    char text[160];
    std::snprintf(text, sizeof text, "cost %.9g, %d iterations in %d solve%s: ", summary.final_cost,
                  iterations, outer, outer == 1 ? "" : "s");
    summary_ = text;
    if (failed_) {
      summary_ += "not converged, " + summary.message;
    } else {
      failed_ = !settled;
      summary_ += settled ? "converged" : "the noise that depends on the state did not settle";
    }
  }

  ceres::Solver::Summary SolveFrozen() {
    const Eigen::Index n = e_.size();
    ceres::Problem problem;
    problem.AddResidualBlock(
        new ceres::NormalPrior(Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd::Zero(n)), nullptr,
        e_.data());
    if (trajectory_.residuals() > 0) {
      problem.AddResidualBlock(new Residuals(trajectory_), nullptr, e_.data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = options_.max_iterations;
    options.initial_trust_region_radius = 1e8;  // Gauss-Newton as long as the cost falls
    options.function_tolerance = 1e-14;
    options.gradient_tolerance = 1e-12;
    options.parameter_tolerance = 1e-12;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    return summary;
  }

  /// U at e_, and the Gauss-Newton step that it gives: Ceres stops before the last one.
  void Covariances() {
    const Eigen::Index n = e_.size(), m = trajectory_.residuals();
    RowMajor j = RowMajor::Identity(n + m, n);
    Eigen::VectorXd r(n + m);
    r.head(n) = e_;
    u_.setIdentity(n, n);
    if (!trajectory_.Evaluate(e_.data(), r.data() + n, j.data() + n * n)) return;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(j);
    u_ = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
    if (!failed_) e_ -= qr.solve(r);
  }

  /// The points of e_, frame by frame.
  template <class Take>
  void Each(const Take& take) {
    Trajectory::Point point;
    bool good = trajectory_.Begin(e_.data(), true, point);
    for (std::size_t k = 0; k < trajectory_.size() && good; ++k) {
      good = trajectory_.Advance(k, e_.data(), point);
      if (good) take(k, point);
    }
  }

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
  UpdateReport report_;
  std::string summary_;
  bool failed_ = false;
};

/// Refuses what a batch cannot do, by name.
void CheckSupported(const System& system, const Node& entry) {
  const auto refuse = [&](const std::string& what, const char* expected) {
    entry.Fail("estimator 'ceres_batch' cannot do this: " + what, expected);
  };
  for (const Block& block : system.layout.blocks()) {
    if (block.status == BlockStatus::kConsidered) {
      refuse("block '" + block.name + "' is considered", "a block estimated or fixed");
    }
  }
  for (const SensorBinding& sensor : system.sensors) {
    if (sensor.loss.kind != LossKind::kNone) {
      refuse("sensor '" + sensor.name + "' has a robust loss", "the sensor without one");
    }
    for (const RoleBinding& role : sensor.roles) {
      if (role.mode != RoleMode::kEstimate) {
        refuse("a role of sensor '" + sensor.name + "' is considered or held", "mode: estimate");
      }
      if (role.linearise_at != LineariseAt::kPrediction) {
        refuse("a role of sensor '" + sensor.name + "' is linearised at the measurement",
               "linearise_at: prediction");
      }
    }
  }
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
                          "[Bell1994]", &alidade::ceres_batch::Create})
