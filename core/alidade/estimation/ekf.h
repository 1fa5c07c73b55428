// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

/// Extended Kalman filter: x' = f(x, u, 0), P' = F P F' + G Q G'; an update with stacked Jacobian H
/// of all accepted measurements, S = H P H' + R = L L', W = P H' L^-T, dx = W L^-1 r, P -= W W'
/// (of few states by S = L D L', which is the same).
/// The gain of a consider block is 0 (Schmidt): P += E E', E = (K - K*) L of the optimal gain K*.
/// Where digits would cancel the Joseph form takes the place of both. With a robust loss on the
/// sensor R / w(d) stands for R, d^2 = r' S^-1 r.
///
/// A control input acts from the timestamp of its frame on, until the next one comes or it is as
/// old as InputBinding::timeout_s; where none acts, u is 0 (event `input_stale`). A gap stepped in
/// parts is noted as the event `substeps`, where it takes at least twice as many as any noted
/// before.
/// Discrete noise w ~ N(0, I) is held over an interval, which ends with whatever changes the state
/// but a step: frames without an accepted measurement are part of it. With Lq of its start and
/// M = Cov(x, w), 0 there, each step of it makes
///
///   N = G Lq,  A = F M:   P' = F P F' + A N' + N A' + N N',   M' = A + N
///
/// Where S is not positive definite because P is not positive semi-definite, P is repaired (event
/// `repaired`: negative pivots of its L D L' count as zero); after `max_covariance_repairs` of that
/// the next ends the filter.
/// Its method is internal::EkfEquations (ekf_equations.h).
class Ekf : public Filter {
 public:
  /// All there is.
  static constexpr EstimatorCapabilities kCapabilities = {.consider = true,
                                                          .at_measurement = true,
                                                          .from_measurement = true,
                                                          .recovery = true,
                                                          .landmarks = true};

  /// `streams` are the source's, in the order of Measurement::stream.
  Ekf(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Ekf(const Problem& problem, const EkfOptions& options = {})
      : Ekf(problem, options, problem.streams) {}
};

}  // namespace alidade
