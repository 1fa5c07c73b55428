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
/// For small states S is factorised as L D L' instead of L L', with an equivalent result. The gain
/// of a consider block is 0 (Schmidt). This adds E E' to P, with E = (K - K*) L and the optimal
/// gain K*. If these formulas would lose digits by cancellation, the Joseph form is used instead.
/// If the sensor has a robust loss, R / w(d) replaces R, with d^2 = r' S^-1 r.
///
/// A control input acts from the timestamp of its frame until the next input, but no longer than
/// InputBinding::timeout_s. If no input acts, u is 0 (event `input_stale`). A gap that is longer
/// than max_dt_s is divided into steps. The event `substeps` reports a gap if it has at least twice
/// as many steps as every gap that was reported before.
///
/// Discrete noise w ~ N(0, I) is constant over an interval. The interval ends at any change of the
/// state other than a step. A frame without an accepted measurement therefore does not end the
/// interval. Lq is evaluated at the start of the interval. M = Cov(x, w) is 0 at the start. Each
/// step computes
///
///   N = G Lq,  A = F M:   P' = F P F' + A N' + N A' + N N',   M' = A + N
///
/// If S is not positive definite because P is not positive semi-definite, P is repaired: the
/// negative pivots of P = L D L' are set to zero (event `repaired`). The filter ends if more than
/// `max_covariance_repairs` repairs are needed.
///
/// internal::EkfEquations (ekf_equations.h) implements the equations.
class Ekf : public Filter {
 public:
  /// An Ekf has all capabilities, so it supports every problem.
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
