// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rts.h"

#include <algorithm>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/square_root_equations.h"
#include "alidade/state/reflections.h"
#include "alidade/state/tiles.h"

namespace alidade {

namespace internal {
namespace {

/// Distribution u ~ N(mu, A A') of the vector u, given all measurements.
class BackwardPass {
 public:
  explicit BackwardPass(Eigen::Index size) {
    Resize(1 + size, size);
    estimate().middleRows(1, size).setIdentity();
  }

  /// Computes the distribution of u before a step or update from that of u' after it.
  void GoBack(const BackwardStep& step) {
    const Workspace::Use use(work_);
    if (step.y.size() > 0) {
      GoBackOverUpdate(step);
    } else {
      GoBackOverStep(step);
    }
  }
  /// Returns D [mu A].
  Workspace::Matrix Project(const Eigen::MatrixXd& directions, Workspace& work) {
    Workspace::Matrix result = work.Take(directions.rows(), rows_);
    result.setZero();
    AddProductWithTransposed(result, directions, estimate().topRows(rows_));
    return result;
  }

 private:
  /// Returns [mu A]', with padded rows (reflections.h).
  Workspace::Matrix estimate() {
    return {numbers_.data(), PaddedSize(static_cast<int>(rows_)), columns_};
  }
  /// Sets [mu A]' to a matrix of zeros.
  void Resize(Eigen::Index rows, Eigen::Index columns) {
    rows_ = rows;
    columns_ = columns;
    numbers_.resize(static_cast<std::size_t>(PaddedSize(static_cast<int>(rows)) * columns));
    std::ranges::fill(numbers_, 0.0);
  }
  void GoBackOverUpdate(const BackwardStep& step);
  void GoBackOverStep(const BackwardStep& step);

  std::vector<double> numbers_;
  Eigen::Index rows_ = 0, columns_ = 0;
  Workspace work_;
};

/// y is known, so its column of [mu A]' contains only its value.
void BackwardPass::GoBackOverUpdate(const BackwardStep& step) {
  Workspace::Matrix u = estimate();
  Workspace::Vector y = work_.Take(u.rows());
  for (Eigen::Index k = step.y.size() - 1; k >= 0; --k) {
    y.setZero();
    y[0] = step.y[k];
    Reflect(u, y.data(), 0, step.reflectors.col(k).data());
  }
}

void BackwardPass::GoBackOverStep(const BackwardStep& step) {
  const Eigen::Index noise = step.noise, all = columns_ + noise, roots = rows_ - 1 + noise;
  Workspace::Matrix u = TakePadded(work_, 1 + roots, all);  // [mu 0; A 0; 0 I]
  u.topLeftCorner(rows_, columns_) = estimate().topRows(rows_);
  u.block(rows_, columns_, noise, noise).setIdentity();
  const Eigen::Index offset = all - step.reflectors.rows();
  for (Eigen::Index k = step.reflectors.cols() - 1; k >= 0; --k) {
    Reflect(u, u.col(offset + k).data(), offset + k + 1, &step.reflectors(k, k));
  }
  const auto before = u.middleCols(step.first, step.size);  // [mu A]' of u before the step
  if (roots <= step.size) {
    Resize(1 + roots, step.size);
    estimate() = before;
    return;
  }
  Workspace::Matrix a = TakePadded(work_, step.size, roots),
                    reflectors = work_.Take(roots, step.size);
  a.topRows(step.size) = before.middleRows(1, roots).transpose();
  Triangularise(a, reflectors);
  Resize(1 + step.size, step.size);
  estimate().row(0) = before.row(0);
  estimate().middleRows(1, step.size) = a.topLeftCorner(step.size, step.size).transpose();
}

}  // namespace
}  // namespace internal

/// Record of one frame of the forward pass, with the estimate after the frame.
struct RtsSmoother::ForwardFrame {
  std::size_t steps;           ///< number of backward steps up to the end of this frame
  Eigen::MatrixXd directions;  ///< D
  std::vector<double> x;
  Eigen::MatrixXd p;
  UpdateReport report;
};

RtsSmoother::RtsSmoother(Problem problem, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams)
    : RtsSmoother(std::move(problem), options, streams,
                  std::make_unique<internal::SquareRootEquations>(true)) {}

RtsSmoother::RtsSmoother(Problem problem, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams,
                         std::unique_ptr<internal::SquareRootEquations> equations)
    : equations_(equations.get()),
      engine_(std::make_unique<internal::FilterEngine>(
          CheckedProblem(std::move(problem), "RtsSmoother", kCapabilities), options, streams,
          std::move(equations))) {}

RtsSmoother::~RtsSmoother() = default;

void RtsSmoother::Start(Timestamp timestamp) { engine_->f.timestamp = timestamp; }
const State& RtsSmoother::state() const { return engine_->f.state; }
Timestamp RtsSmoother::timestamp() const { return engine_->f.timestamp; }
bool RtsSmoother::diverged() const { return engine_->f.health.diverged; }
bool RtsSmoother::failed() const { return engine_->f.health.ended; }

const UpdateReport& RtsSmoother::Process(const Frame& frame) {
  const internal::FilterState& f = engine_->f;
  engine_->Process(frame);
  forward_frames_.push_back(
      {equations_->backward_steps().size(), equations_->Root(f), f.state.values(), {}, f.report});
  forward_frames_.back().report.events.clear();  // Process has reported them already
  return f.report;
}

void RtsSmoother::Smooth(const Emit& emit) {
  if (forward_frames_.empty()) return;
  const std::vector<internal::BackwardStep>& steps = equations_->backward_steps();
  std::size_t step = steps.size();
  internal::BackwardPass pass(forward_frames_.back().directions.cols());
  Workspace work;
  State smoothed = state();
  for (auto frame = forward_frames_.rbegin(); frame != forward_frames_.rend(); ++frame) {
    while (step > frame->steps) pass.GoBack(steps[--step]);
    const Workspace::Use use(work);
    const Workspace::Matrix projected = pass.Project(frame->directions, work);  // D [mu A]
    smoothed.values() = frame->x;
    if (!smoothed.Retract(projected.col(0).data(), frame->x)) {
      engine_->f.health.ended = true;
      throw Error(ExitCode::kDiverged, "a smoothed estimate is not finite");
    }
    LowerTriangle p = smoothed.covariance().lower();
    p.setZero();
    internal::AddOuterProduct(p, projected.rightCols(projected.cols() - 1), 1.0);
    smoothed.MoveTo(frame->x);
    frame->p = smoothed.covariance().Dense();
  }
  for (std::size_t k = 0; k < forward_frames_.size(); ++k) {
    const ForwardFrame& frame = forward_frames_[k];
    smoothed.values() = frame.x;
    smoothed.covariance().SetBlock(0, 0, frame.p);
    emit(k, smoothed, frame.report);
  }
}

}  // namespace alidade
