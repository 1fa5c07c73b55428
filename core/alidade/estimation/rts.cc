// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rts.h"

#include "alidade/base/error.h"
#include "alidade/estimation/ekf_equations.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {
namespace internal {

/// Backward step over a frame: lambda <- A' lambda + b, Lambda <- A' Lambda A + information. If the
/// frame starts inside an interval, A has columns for w after the columns for x.
struct Adjoint {
  Eigen::MatrixXd a;  ///< n x n, or n x (n + n_w)
  Eigen::VectorXd b;
  Eigen::MatrixXd information;

  /// Applies the step to lambda and Lambda. At the end of the frame, lambda and Lambda have
  /// `end_noise` rows for w after the rows for x.
  void StepBack(Eigen::Index end_noise, Eigen::VectorXd& lambda,
                Eigen::MatrixXd& lambda_matrix) const {
    const Eigen::Index n = a.rows(), start_noise = a.cols() - n;
    Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(n + end_noise, n + start_noise);
    joint.topRows(n) = a;
    if (start_noise > 0) joint.bottomRightCorner(end_noise, start_noise).setIdentity();
    lambda = joint.transpose() * lambda + b;
    lambda_matrix = Product(TransposedProduct(joint, lambda_matrix), joint) + information;
    lambda_matrix = 0.5 * (lambda_matrix + lambda_matrix.transpose()).eval();
  }
};

/// EkfEquations that also record each step and update as a backward step (Adjoint).
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

  /// Starts recording a new frame.
  void StartFrame(const FilterState& f);
  const Adjoint& frame() const { return frame_; }

 private:
  EkfEquations ekf_;
  Adjoint frame_;
};

void RecordingEquations::StartFrame(const FilterState& f) {
  const Eigen::Index n = f.size();
  const Eigen::Index columns = n + (f.motions.in_interval() ? f.motions.noise_size() : 0);
  frame_ = {Eigen::MatrixXd::Identity(n, columns), Eigen::VectorXd::Zero(columns),
            Eigen::MatrixXd::Zero(columns, columns)};
}

StepError RecordingEquations::Step(FilterState& f, double dt_s) {
  if (StepError error = ekf_.Step(f, dt_s)) return error;
  const Workspace::Use use(f.work);
  frame_.a = f.motions.Transition(f.size(), f.work) * frame_.a;
  const Eigen::Index noises = frame_.a.cols() - frame_.a.rows();
  if (noises > 0)
    frame_.a.rightCols(noises) += f.motions.NoiseColumns(&Motions::Step::gl, f.size(), f.work);
  return {};
}

Outcome RecordingEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const std::vector<double> prediction = f.state.values();
  const Outcome outcome = ekf_.Correct(f, rows);
  if (outcome != Outcome::kAccepted || f.size() == 0) return outcome;
  const Workspace::Use use(f.work);
  const Eigen::Index n = f.size(), m = f.update.rows();
  // If S = l l', w = P H' l^-T and g = l^-1 H, then K H = w g, H' S^-1 H = g' g and H' S^-1 r =
  // g' y.
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
  const Workspace::Matrix back = TransportTo(f.state, prediction, f.work);
  frame_.b += frame_.a.transpose() * (g.transpose() * y);
  const Eigen::MatrixXd weighted = Product(g, frame_.a);
  frame_.information += TransposedProduct(weighted, weighted);
  frame_.a = Product(TransposedProduct(back, a), frame_.a);
  return outcome;
}

}  // namespace internal

/// Record of one frame of the forward pass, with the estimate after the frame.
struct RtsSmoother::ForwardFrame {
  internal::Adjoint adjoint;
  std::vector<double> x;
  Eigen::MatrixXd p;
  Eigen::MatrixXd m;  ///< M if the frame ends inside an interval, else n x 0
  UpdateReport report;
};

RtsSmoother::RtsSmoother(Problem problem, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams)
    : RtsSmoother(std::move(problem), options, streams,
                  std::make_unique<internal::RecordingEquations>()) {}

RtsSmoother::RtsSmoother(Problem problem, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams,
                         std::unique_ptr<internal::RecordingEquations> equations)
    : equations_(equations.get()),
      engine_(std::make_unique<internal::FilterEngine>(
          CheckedProblem(std::move(problem), "RtsSmoother", kCapabilities),
          internal::WithoutRecovery(options), streams, std::move(equations))) {}

RtsSmoother::~RtsSmoother() = default;

void RtsSmoother::Start(Timestamp timestamp) { engine_->f.timestamp = timestamp; }
const State& RtsSmoother::state() const { return engine_->f.state; }
Timestamp RtsSmoother::timestamp() const { return engine_->f.timestamp; }
bool RtsSmoother::diverged() const { return engine_->f.health.diverged; }
bool RtsSmoother::failed() const { return engine_->f.health.ended; }

const UpdateReport& RtsSmoother::Process(const Frame& frame) {
  const internal::FilterState& f = engine_->f;
  equations_->StartFrame(f);
  engine_->Process(frame);
  Workspace work;
  Eigen::MatrixXd m(f.size(), 0);
  if (f.motions.in_interval())
    m = f.motions.NoiseColumns(&internal::Motions::Step::m, f.size(), work);
  forward_frames_.push_back(
      {equations_->frame(), f.state.values(), f.state.covariance().Dense(), m, f.report});
  forward_frames_.back().report.events.clear();  // Process returns these events in its report
  return f.report;
}

void RtsSmoother::Smooth(const Emit& emit) {
  const Eigen::Index n = state().covariance().size();
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);  // Lambda
  std::vector<Event> events;
  State smoothed = state();
  for (auto frame = forward_frames_.rbegin(); frame != forward_frames_.rend(); ++frame) {
    // Number of elements of w if the interval continues, else 0.
    const Eigen::Index noises = lambda.size() - n;
    Eigen::MatrixXd joint(n, n + noises);  // Cov(x, (x, w))
    joint.leftCols(n) = frame->p;
    joint.rightCols(noises) = frame->m.leftCols(noises);
    const Eigen::MatrixXd p = frame->p - internal::Congruence(joint, information);
    const bool is_positive = (p.diagonal().array() >= 0.0).all();
    if (!is_positive) {
      events.push_back({timestamp(), EventKind::kNotPd,
                        "rounding made a smoothed variance in frame " +
                            std::to_string(forward_frames_.rend() - frame - 1) +
                            " negative; the covariance of the forward pass "
                            "replaces the smoothed covariance"});
    }
    smoothed.values() = frame->x;
    smoothed.Retract((joint * lambda).eval().data(), frame->x);
    if (is_positive) frame->p = p;
    smoothed.covariance().SetBlock(0, 0, frame->p);
    smoothed.MoveTo(frame->x);
    frame->p = smoothed.covariance().Dense();
    frame->adjoint.StepBack(noises, lambda, information);
  }
  for (std::size_t k = 0; k < forward_frames_.size(); ++k) {
    ForwardFrame& frame = forward_frames_[k];
    smoothed.values() = frame.x;
    smoothed.covariance().SetBlock(0, 0, frame.p);
    if (k + 1 == forward_frames_.size()) frame.report.events = events;
    emit(k, smoothed, frame.report);
  }
}

}  // namespace alidade
