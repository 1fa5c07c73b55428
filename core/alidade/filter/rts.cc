// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/rts.h"

#include <Eigen/Cholesky>

#include "alidade/filter/filter_options.h"

namespace alidade {

RtsSmoother::RtsSmoother(System system, const EkfOptions& options,
                         const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), internal::WithoutRecovery(options), streams, Steps::kOverridden) {
  ALIDADE_EXPECTS(!FindUnsupported(system_, kSupport));
}

void RtsSmoother::Adjoint::Append(const Eigen::MatrixXd& later_a, const Eigen::VectorXd& later_b,
                                  const Eigen::MatrixXd& later_information) {
  b += a.transpose() * later_b;
  information += a.transpose() * later_information * a;
  a = later_a * a;
}

/// `held`: of lambda and Lambda at the end of the frame, the rows of w behind those of x.
void RtsSmoother::Adjoint::GoBack(Eigen::Index held, Eigen::VectorXd& lambda,
                                  Eigen::MatrixXd& later_information) const {
  const Eigen::Index n = a.rows(), before = a.cols() - n;
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(n + held, n + before);
  whole.topRows(n) = a;
  if (before > 0) whole.bottomRightCorner(held, before).setIdentity();
  lambda = whole.transpose() * lambda + b;
  later_information = whole.transpose() * later_information * whole + information;
  later_information = 0.5 * (later_information + later_information.transpose()).eval();
}

const UpdateReport& RtsSmoother::Process(const Frame& frame) {
  const Workspace::Use use(work_);
  const Eigen::Index n = state_.covariance().size(), all = n + (InInterval() ? NoiseSize() : 0);
  current_ = {Eigen::MatrixXd::Identity(n, all), Eigen::VectorXd::Zero(all),
              Eigen::MatrixXd::Zero(all, all)};
  const UpdateReport& report = Ekf::Process(frame);
  passed_frames_.push_back({current_, state_.values(), state_.covariance().Dense(),
                            InInterval() ? Eigen::MatrixXd(HeldNoise()) : Eigen::MatrixXd(n, 0),
                            report});
  passed_frames_.back().report.events.clear();  // told already
  return report;
}

bool RtsSmoother::StepOnce(double dt_s) {
  if (!Ekf::StepOnce(dt_s)) return false;
  const Workspace::Use use(work_);
  current_.a = Transition() * current_.a;
  const Eigen::Index held = current_.a.cols() - current_.a.rows();
  if (held > 0) current_.a.rightCols(held) += HeldInput();
  return true;
}

Outcome RtsSmoother::Apply(std::span<Row* const> rows) {
  const Workspace::Use use(work_);
  const Stacked all = Stack(rows);
  const Eigen::MatrixXd p = state_.covariance().Dense();
  const std::vector<double> before = state_.values();
  const Outcome outcome = Ekf::Apply(rows);
  if (outcome != Outcome::kAccepted) return outcome;
  // The filter has factorised the same S.
  const Eigen::LLT<Eigen::MatrixXd> s(all.h * p * all.h.transpose() + all.noise);
  const Eigen::MatrixXd weighted = s.solve(all.h);  // S^-1 H
  Eigen::MatrixXd a = -p * all.h.transpose() * weighted;
  a.diagonal().array() += 1.0;
  const Workspace::Matrix back = TransportTo(before);
  current_.Append(back.transpose() * a, weighted.transpose() * all.innovation,
                  all.h.transpose() * weighted);
  return outcome;
}

void RtsSmoother::Smooth(const Emit& emit) {
  const Eigen::Index n = state_.covariance().size();
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);  // Lambda
  std::vector<Event> events;
  State smoothed = state_;
  for (auto passed = passed_frames_.rbegin(); passed != passed_frames_.rend(); ++passed) {
    const Eigen::Index held = lambda.size() - n;  // noise inputs, of an interval that goes on
    Eigen::MatrixXd with(n, n + held);            // Cov(x, (x, w))
    with.leftCols(n) = passed->p;
    with.rightCols(held) = passed->m.leftCols(held);
    const Eigen::MatrixXd p = passed->p - with * information * with.transpose();
    const bool positive = (p.diagonal().array() >= 0.0).all();
    if (!positive) {
      events.push_back({timestamp_, "not_pd",
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
