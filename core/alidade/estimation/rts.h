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

/// Fixed-interval smoother: the estimate of every frame from the measurements of all. An extended
/// Kalman filter goes forward; the way back is that of Rauch, Tung and Striebel in the adjoint form
/// of Bryson and Frazier, which inverts no covariance: P may be singular. n = size of P.
///
///   estimate   x_s = x (+) P lambda,   P_s = P - P Lambda P      x, P: the filter's, of the frame
///   start      lambda = 0, Lambda = 0                            at the last frame
///   step       lambda <- F' lambda,   Lambda <- F' Lambda F
///   update     lambda <- A' lambda + H' S^-1 r,   Lambda <- A' Lambda A + H' S^-1 H,
///              A = I - K H
///
/// Discrete noise w, held over an interval, is smoothed with x. At frames inside an interval lambda
/// and Lambda are those of (x, w), with [P M] for P, M = Cov(x, w), and [F G Lq; 0 I] for F. Where
/// the interval starts, what they have of w is dropped.
///
/// All Jacobians are those of the filter, and so are R and its weight under a robust loss.
///
/// Source       [Rauch1965]; [Bierman1977] ch. X, modified Bryson-Frazier.
class RtsSmoother : public Estimator {
 public:
  /// No consider blocks and roles, none that start or are linearised at a measurement, no
  /// rejection recovery, no landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {};

  /// `options.rejection_recovery` counts as kNone. Errors: kBadConfig if `problem` asks for more
  /// than kCapabilities.
  RtsSmoother(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit RtsSmoother(const Problem& problem, const EkfOptions& options = {})
      : RtsSmoother(problem, options, problem.streams) {}
  ~RtsSmoother() override;

  void Start(Timestamp timestamp) override;
  const UpdateReport& Process(const Frame& frame) override;
  bool offline() const override { return true; }
  /// The reports are the filter's. Event `not_pd` where rounding would leave a smoothed variance
  /// negative: the covariance of that frame is then the filter's.
  void Smooth(const Emit& emit) override;
  const State& state() const override;
  Timestamp timestamp() const override;
  bool diverged() const override;
  bool failed() const override;

 private:
  struct Passed;
  RtsSmoother(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
              std::unique_ptr<internal::RecordingEquations> tape);

  internal::RecordingEquations* tape_;  ///< the method of the loop
  std::unique_ptr<internal::FilterEngine> engine_;
  std::vector<Passed> passed_frames_;
};

}  // namespace alidade
