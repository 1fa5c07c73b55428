// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

namespace internal {
class SquareRootEquations;
}

/// Fixed-interval smoother: estimates the state at every frame from the measurements of all frames.
/// The forward pass is SquareRootEkf. The backward pass computes the same estimates as the smoother
/// of Rauch, Tung and Striebel from the orthogonal matrices of the forward pass. It neither
/// subtracts covariances nor inverts them. P may therefore be singular, and a vague prior costs few
/// digits.
///
/// The forward pass describes the state as x (+) D u with u ~ N(0, I), P = D D'. The array of each
/// step and of each update is triangularised by an orthogonal matrix Q = [Q11 Q12; Q21 Q22]. The
/// backward pass computes the distribution of u given all measurements, u ~ N(mu, A A'):
///
///   estimate   x_s = x (+) D mu,   P_s = (D A) (D A)'
///   start      mu = 0, A = I                                      at the last frame
///   step       [u; w] = Q [u+; v]:   mu <- Q11 mu,                A A' <- [Q11 A, Q12] [...]'
///   update     [n; u] = Q [Ls^-1 r; u+]:   mu <- Q21 Ls^-1 r + Q22 mu,   A <- Q22 A
///
/// w and n are the noise of the step and of the measurement, u+ is u after the step or update, and
/// v has no effect on the state after the step. A is triangularised again after each step. Discrete
/// noise is a part of u during its interval, and D = [B M].
///
/// Jacobians, R and robust weights are those of the forward pass. If the forward pass recovers from
/// rejections, later measurements do not change the estimates before the recovery.
///
/// Source       [Rauch1965] the smoothed estimates; [Bierman1977] ch. V, X, the arrays.
class RtsSmoother : public Estimator {
 public:
  /// Does not support consider blocks or roles, blocks that start from a measurement, roles with
  /// `jacobian_at: measurement`, or landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {.recovery = true};

  /// Throws Error kBadConfig if
  /// `problem` needs more than kCapabilities.
  RtsSmoother(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit RtsSmoother(const Problem& problem, const EkfOptions& options = {})
      : RtsSmoother(problem, options, problem.streams) {}
  ~RtsSmoother() override;

  void Start(Timestamp timestamp) override;
  const UpdateReport& Process(const Frame& frame) override;
  bool offline() const override { return true; }
  /// The reports are those of the forward pass.
  void Smooth(const Emit& emit) override;
  const State& state() const override;
  Timestamp timestamp() const override;
  bool diverged() const override;
  bool failed() const override;

 private:
  struct ForwardFrame;
  RtsSmoother(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
              std::unique_ptr<internal::SquareRootEquations> equations);

  internal::SquareRootEquations* equations_;  ///< points to the method of engine_
  std::unique_ptr<internal::FilterEngine> engine_;
  std::vector<ForwardFrame> forward_frames_;
};

}  // namespace alidade
