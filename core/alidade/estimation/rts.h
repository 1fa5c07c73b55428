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
/// The forward pass describes the state as x (+) D u with u ~ N(0, I), P = D D'. Each step and each
/// update multiplies u and the noise by an orthogonal matrix Q, a product of reflections. The
/// backward pass applies the same reflections in reverse order. It computes the distribution of u
/// given all measurements, u ~ N(mu, A A'):
///
///   estimate   x_s = x (+) D mu,   P_s = (D A) (D A)'
///   start      mu = 0, A = I                                      at the last frame
///   step       [u; w] = Q [u+; v]:   [mu A] <- rows of u in Q [mu+  A+  0]
///                                                             [ 0   0   I]
///   update     [n; u] = Q [y; u+]:   [mu A] <- rows of u in Q [ y   0 ],   y = Ls^-1 r
///                                                             [mu+  A+]
///
/// w and n are the noise of the step and of the measurement, u+ is u after the step or update, and
/// v ~ N(0, I) has no effect on the state after the step. A is triangularised after each step.
/// Discrete noise is a part of u during its interval, and D = [M B]. The complexity is O(n^3) for a
/// step and for the estimate of a frame, and O(n^2 m) for an update.
///
/// Jacobians, R and robust weights are those of the forward pass. If the forward pass recovers from
/// rejections, later measurements do not change the estimates before the recovery.
///
/// Source       [Rauch1965] the smoothed estimates; [Bierman1977] ch. V, X, the arrays and the
///              reflections.
class RtsSmoother : public Estimator {
 public:
  /// Does not support consider blocks or roles, blocks that start from a measurement, roles with
  /// `jacobian_at: measurement`, or landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {.recovery = true};

  /// Throws Error kBadConfig if `problem` needs more than kCapabilities.
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
