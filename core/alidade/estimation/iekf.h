// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

struct IekfOptions : EkfOptions {
  int max_iterations = 10;  ///< most linearisations of an update; at least 2
  /// An update has converged where its next step is at most this, in posterior standard deviations;
  /// > 0.
  double tolerance = 1e-4;
};

/// Iterated extended Kalman filter [Bell1993]: as Ekf, with updates that minimise
///
///   c(dx) = dx' P^-1 dx + r' R^-1 r,   r = z (-) h(x (+) dx)
///
/// over dx by Gauss-Newton, P the prediction's covariance. At each iterate, H = d h / d dx there,
///
///   dx+ = K (r + H dx),   K = P H' S^-1,   S = H P H' + R
///
/// and the step dx+ - dx is halved while c rises, or h is not defined. R is that of the iterate,
/// kept during a step. The covariance is P - K S K' of the last linearisation. Gate and robust loss
/// are decided at the prediction, and h, S and NIS are reported as they are there.
///
/// An update that does not converge keeps its last iterate and notes the event `not_converged`; so
/// does one that comes to where h has no Jacobian. One with R not positive definite has no such c:
/// it is that of the Ekf.
class Iekf : public Filter {
 public:
  /// No consider blocks and roles, no role linearised at the measurement.
  static constexpr EstimatorCapabilities kCapabilities = {
      .from_measurement = true, .recovery = true, .landmarks = true};

  /// Errors: kBadConfig if `problem` asks for more than kCapabilities, `jacobian` is not kLatest or
  /// an option is out of its range.
  Iekf(Problem problem, const IekfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Iekf(const Problem& problem, const IekfOptions& options = {})
      : Iekf(problem, options, problem.streams) {}
};

}  // namespace alidade
