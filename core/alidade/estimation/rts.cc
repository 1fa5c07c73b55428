// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/rts.h"

#include <utility>

#include "alidade/base/error.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/square_root_equations.h"
#include "alidade/state/dense_algebra.h"

namespace alidade {

/// Record of one frame of the forward pass, with the estimate after the frame.
struct RtsSmoother::ForwardFrame {
  std::vector<internal::BackwardStep> steps;
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
  forward_frames_.push_back({equations_->ExtractBackwardSteps(),
                             equations_->Directions(f),
                             f.state.values(),
                             {},
                             f.report});
  forward_frames_.back().report.events.clear();  // Process has reported them already
  return f.report;
}

void RtsSmoother::Smooth(const Emit& emit) {
  if (forward_frames_.empty()) return;
  const Eigen::Index size = forward_frames_.back().directions.cols();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(size, size);  // u ~ N(mean, root root')
  State smoothed = state();
  for (auto frame = forward_frames_.rbegin(); frame != forward_frames_.rend(); ++frame) {
    const Eigen::MatrixXd root_of_p = internal::Product(frame->directions, root);
    const Eigen::VectorXd correction = frame->directions * mean;
    smoothed.values() = frame->x;
    smoothed.Retract(correction.data(), frame->x);
    smoothed.covariance().SetBlock(0, 0, internal::ProductTransposed(root_of_p, root_of_p));
    smoothed.MoveTo(frame->x);
    frame->p = smoothed.covariance().Dense();
    for (auto step = frame->steps.rbegin(); step != frame->steps.rend(); ++step) {
      mean = step->transition * mean + step->offset;
      root = internal::Product(step->transition, root);
      if (step->noise.cols() == 0) continue;
      Eigen::MatrixXd wide(root.rows(), root.cols() + step->noise.cols());  // [T root, C]
      wide << root, step->noise;
      root = internal::UpperTriangleOf(wide.transpose()).transpose();
    }
  }
  for (std::size_t k = 0; k < forward_frames_.size(); ++k) {
    const ForwardFrame& frame = forward_frames_[k];
    smoothed.values() = frame.x;
    smoothed.covariance().SetBlock(0, 0, frame.p);
    emit(k, smoothed, frame.report);
  }
}

}  // namespace alidade
