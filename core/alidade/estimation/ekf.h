// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

/// Extended Kalman filter. H is the stacked Jacobian of all accepted measurements.
///
///   step       x' = f(x, u, 0),   P' = F P F' + G Q G'
///   update     S = H P H' + R = L L',   W = P H' L^-T,   dx = W L^-1 r,   P -= W W'
///
/// With few states, S = L D L' replaces S = L L'; the result is the same. The gain of a consider
/// block is 0 (Schmidt): P += E E', E = (K - K*) L with the optimal gain K*. If digits would
/// cancel, the Joseph form replaces both. With a robust loss on the sensor, R / w(d) replaces R,
/// d^2 = r' S^-1 r.
///
/// A control input acts from the timestamp of its frame until the next input, at most for
/// InputBinding::timeout_s. If no input acts, u is 0 (event `input_stale`). The event `substeps`
/// reports a gap that is divided into at least twice as many steps as any gap reported before.
///
/// Discrete noise w ~ N(0, I) is constant over an interval. The interval ends when anything but a
/// step changes the state; frames without an accepted measurement do not end it. With Lq of the
/// start of the interval and M = Cov(x, w), which is 0 there, each step computes
///
///   N = G Lq,  A = F M:   P' = F P F' + A N' + N A' + N N',   M' = A + N
///
/// If S is not positive definite because P is not positive semi-definite, P is repaired: negative
/// pivots of its L D L' count as zero (event `repaired`). After `max_covariance_repairs` repairs
/// the next one ends the filter.
///
/// Implementation: internal::EkfEquations (ekf_equations.h).
class Ekf : public Filter {
 public:
  /// All capabilities.
  static constexpr EstimatorCapabilities kCapabilities = {.consider = true,
                                                          .at_measurement = true,
                                                          .from_measurement = true,
                                                          .recovery = true,
                                                          .landmarks = true};

  /// `streams` are the streams of the source, in the order of Measurement::stream.
  Ekf(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Ekf(const Problem& problem, const EkfOptions& options = {})
      : Ekf(problem, options, problem.streams) {}
};

}  // namespace alidade
