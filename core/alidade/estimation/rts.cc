// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rts.h"

#include "alidade/base/error.h"
#include "alidade/estimation/ekf_equations.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace internal {

/// How the adjoint goes back over a frame: lambda <- A' lambda + b, Lambda <- A' Lambda A +
/// information. Where the frame starts inside an interval, A has columns for w behind those of x.
struct Adjoint {
  Eigen::MatrixXd a;  ///< n x n, or n x (n + n_w)
  Eigen::VectorXd b;
  Eigen::MatrixXd information;

  /// `held`: of lambda and Lambda at the end of the frame, the rows of w behind those of x.
  void GoBack(Eigen::Index held, Eigen::VectorXd& lambda, Eigen::MatrixXd& later) const {
    const Eigen::Index n = a.rows(), before = a.cols() - n;
    Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(n + held, n + before);
    whole.topRows(n) = a;
    if (before > 0) whole.bottomRightCorner(held, before).setIdentity();
    lambda = whole.transpose() * lambda + b;
    later = Product(TransposedProduct(whole, later), whole) + information;
    later = 0.5 * (later + later.transpose()).eval();
  }
};

/// EkfEquations, that takes its steps and updates down as an adjoint.
class RecordingEquations : public UpdateMethod {
 public:
  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<RecordingEquations>(*this);
  }
  StepError Step(FilterState& f, double dt_s) override;
  void BeginUpdate(FilterState& f, int capacity) override { ekf_.BeginUpdate(f, capacity); }
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override {
    return ekf_.Predict(f, pending);
  }
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override {
    return ekf_.ComputeNis(f, pending);
  }
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override;

  /// From here on is another frame.
  void StartFrame(const FilterState& f);
  const Adjoint& frame() const { return frame_; }

 private:
  EkfEquations ekf_;
  Adjoint frame_;
};

void RecordingEquations::StartFrame(const FilterState& f) {
  const Eigen::Index n = f.size();
  const Eigen::Index all = n + (f.motions.in_interval() ? f.motions.noise_size() : 0);
  frame_ = {Eigen::MatrixXd::Identity(n, all), Eigen::VectorXd::Zero(all),
            Eigen::MatrixXd::Zero(all, all)};
}

StepError RecordingEquations::Step(FilterState& f, double dt_s) {
  if (StepError error = ekf_.Step(f, dt_s)) return error;
  const Workspace::Use use(f.work);
  frame_.a = f.motions.Transition(f.size(), f.work) * frame_.a;
  const Eigen::Index held = frame_.a.cols() - frame_.a.rows();
  if (held > 0) frame_.a.rightCols(held) += f.motions.Held(&Motions::Step::gl, f.size(), f.work);
  return {};
}

Outcome RecordingEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const std::vector<double> before = f.state.values();
  const Outcome outcome = ekf_.Correct(f, rows);
  if (outcome != Outcome::kAccepted || f.size() == 0) return outcome;
  const Workspace::Use use(f.work);
  const Eigen::Index n = f.size(), m = f.update.rows();
  // With S = l l', w = P H' l^-T, g = l^-1 H: K H = w g, H' S^-1 H = g' g, H' S^-1 r = g' y.
  Eigen::MatrixXd l(m, m), w(n, m), g = JacobianOf(f, rows);
  Eigen::VectorXd y(m);
  f.update.CopyFactor(l);
  f.update.CopyColumns(0, w);
  for (Eigen::Index k = 0; k < m; ++k) {
    w.col(k) /= l(k, k);
    y[k] = f.update.y()[static_cast<std::size_t>(k)] / l(k, k);
  }
  l.triangularView<Eigen::Lower>().solveInPlace(g);
  Eigen::MatrixXd a = -Product(w, g);  // I - K H
  a.diagonal().array() += 1.0;
  const Workspace::Matrix back = TransportTo(f.state, before, f.work);
  frame_.b += frame_.a.transpose() * (g.transpose() * y);
  const Eigen::MatrixXd weighted = Product(g, frame_.a);
  frame_.information += TransposedProduct(weighted, weighted);
  frame_.a = Product(TransposedProduct(back, a), frame_.a);
  return outcome;
}

}  // namespace internal

/// One frame, and the filter's estimate after it.
struct RtsSmoother::Passed {
  internal::Adjoint adjoint;
  std::vector<double> x;
  Eigen::MatrixXd p;
  Eigen::MatrixXd m;  ///< M inside an interval, else n x 0
  UpdateReport report;
};

RtsSmoother::RtsSmoother(Problem problem, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams)
    : RtsSmoother(std::move(problem), options, streams,
                  std::make_unique<internal::RecordingEquations>()) {}

RtsSmoother::RtsSmoother(Problem problem, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams,
                         std::unique_ptr<internal::RecordingEquations> tape)
    : tape_(tape.get()),
      engine_(std::make_unique<internal::FilterEngine>(
          CheckedProblem(std::move(problem), "RtsSmoother", kCapabilities),
          internal::WithoutRecovery(options), streams, std::move(tape))) {}

RtsSmoother::~RtsSmoother() = default;

void RtsSmoother::Start(Timestamp timestamp) { engine_->f.timestamp = timestamp; }
const State& RtsSmoother::state() const { return engine_->f.state; }
Timestamp RtsSmoother::timestamp() const { return engine_->f.timestamp; }
bool RtsSmoother::diverged() const { return engine_->f.health.diverged; }
bool RtsSmoother::failed() const { return engine_->f.health.ended; }

const UpdateReport& RtsSmoother::Process(const Frame& frame) {
  const internal::FilterState& f = engine_->f;
  tape_->StartFrame(f);
  engine_->Process(frame);
  Workspace work;
  Eigen::MatrixXd held(f.size(), 0);
  if (f.motions.in_interval()) held = f.motions.Held(&internal::Motions::Step::m, f.size(), work);
  passed_frames_.push_back(
      {tape_->frame(), f.state.values(), f.state.covariance().Dense(), held, f.report});
  passed_frames_.back().report.events.clear();  // told already
  return f.report;
}

void RtsSmoother::Smooth(const Emit& emit) {
  const Eigen::Index n = state().covariance().size();
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);  // Lambda
  std::vector<Event> events;
  State smoothed = state();
  for (auto passed = passed_frames_.rbegin(); passed != passed_frames_.rend(); ++passed) {
    const Eigen::Index held = lambda.size() - n;  // noise inputs, of an interval that goes on
    Eigen::MatrixXd with(n, n + held);            // Cov(x, (x, w))
    with.leftCols(n) = passed->p;
    with.rightCols(held) = passed->m.leftCols(held);
    const Eigen::MatrixXd p = passed->p - internal::Congruence(with, information);
    const bool positive = (p.diagonal().array() >= 0.0).all();
    if (!positive) {
      events.push_back({timestamp(), "not_pd",
                        "a smoothed variance is negative by rounding in frame " +
                            std::to_string(passed_frames_.rend() - passed - 1) +
                            "; its covariance is the filter's"});
    }
    smoothed.values() = passed->x;
    smoothed.Retract((with * lambda).eval().data(), passed->x);
    if (positive) passed->p = p;
    smoothed.covariance().SetBlock(0, 0, passed->p);
    smoothed.MoveTo(passed->x);
    passed->p = smoothed.covariance().Dense();
    passed->adjoint.GoBack(held, lambda, information);
  }
  for (std::size_t k = 0; k < passed_frames_.size(); ++k) {
    Passed& passed = passed_frames_[k];
    smoothed.values() = passed.x;
    smoothed.covariance().SetBlock(0, 0, passed.p);
    if (k + 1 == passed_frames_.size()) passed.report.events = events;
    emit(k, smoothed, passed.report);
  }
}

}  // namespace alidade
