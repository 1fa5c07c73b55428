// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

namespace internal {
class RecordingEquations;
}

/// Fixed-interval smoother: estimates the state at every frame from the measurements of all frames.
/// The forward pass is an extended Kalman filter. The backward pass is the smoother of Rauch, Tung
/// and Striebel in the adjoint form of Bryson and Frazier. This form does not invert a covariance,
/// so P may be singular. n: size of P.
///
///   estimate   x_s = x (+) P lambda,   P_s = P - P Lambda P      x, P: estimate of the filter
///   start      lambda = 0, Lambda = 0                            at the last frame
///   step       lambda <- F' lambda,   Lambda <- F' Lambda F
///   update     lambda <- A' lambda + H' S^-1 r,   Lambda <- A' Lambda A + H' S^-1 H,
///              A = I - K H
///
/// Discrete noise w, which is constant over an interval, is smoothed together with x. At frames
/// inside an interval, lambda and Lambda belong to (x, w). [P M] then replaces P, with M = Cov(x,
/// w), and [F G Lq; 0 I] replaces F. At the start of the interval, the elements of w are removed
/// from lambda and Lambda.
///
/// The backward pass uses the Jacobians, R and robust weights of the forward pass.
///
/// Source       [Rauch1965]; [Bierman1977] ch. X, modified Bryson-Frazier.
class RtsSmoother : public Estimator {
 public:
  /// Does not support consider blocks or roles, blocks that start from a measurement, roles with
  /// `jacobian_at: measurement`, rejection recovery, or landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {};

  /// `options.rejection_recovery` is ignored, because the smoother does not support recovery.
  /// Throws Error kBadConfig if `problem` needs more than kCapabilities.
  RtsSmoother(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit RtsSmoother(const Problem& problem, const EkfOptions& options = {})
      : RtsSmoother(problem, options, problem.streams) {}
  ~RtsSmoother() override;

  void Start(Timestamp timestamp) override;
  const UpdateReport& Process(const Frame& frame) override;
  bool offline() const override { return true; }
  /// Passes the reports of the forward pass to `emit`. If rounding makes a smoothed variance of a
  /// frame negative, the covariance of the forward pass replaces the smoothed covariance (event
  /// `not_pd`).
  void Smooth(const Emit& emit) override;
  const State& state() const override;
  Timestamp timestamp() const override;
  bool diverged() const override;
  bool failed() const override;

 private:
  struct ForwardFrame;
  RtsSmoother(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
              std::unique_ptr<internal::RecordingEquations> equations);

  internal::RecordingEquations* equations_;  ///< points to the method of engine_
  std::unique_ptr<internal::FilterEngine> engine_;
  std::vector<ForwardFrame> forward_frames_;
};

}  // namespace alidade
