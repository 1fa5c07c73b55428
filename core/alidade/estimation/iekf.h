// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

/// Options of Iekf.
struct IekfOptions : EkfOptions {
  int max_iterations = 10;  ///< maximum number of linearisations of an update; at least 2
  /// An update has converged if the next step is at most this multiple of the posterior standard
  /// deviation. Must be > 0.
  double tolerance = 1e-4;
};

/// Iterated extended Kalman filter [Bell1993]: an Ekf with updates that minimise
///
///   c(dx) = dx' P^-1 dx + r' R^-1 r,   r = z (-) h(x (+) dx)
///
/// over dx by the Gauss-Newton method. P is the covariance of the prediction. With H = d h / d dx
/// at the current iterate, each iteration computes
///
///   dx+ = K (r + H dx),   K = P H' S^-1,   S = H P H' + R
///
/// The step dx+ - dx is halved as long as it would increase c, or h is not defined at its end. R is
/// evaluated at the iterate and is constant during a step. The new covariance is P - K S K' at the
/// last linearisation. The gate, the robust weight, and the reported h, S and NIS are computed at
/// the prediction.
///
/// If an update does not converge, or reaches a point at which h has no Jacobian, the last iterate
/// is used (event `not_converged`). If R is not positive definite, c is not defined, and the update
/// is that of the Ekf.
class Iekf : public Filter {
 public:
  /// Does not support consider blocks, consider roles, or roles with `jacobian_at: measurement`.
  static constexpr EstimatorCapabilities kCapabilities = {
      .from_measurement = true, .recovery = true, .landmarks = true};

  /// Throws Error kBadConfig if `problem` needs more than kCapabilities, `jacobian` is not kLatest,
  /// or an option is out of range.
  Iekf(Problem problem, const IekfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Iekf(const Problem& problem, const IekfOptions& options = {})
      : Iekf(problem, options, problem.streams) {}
};

}  // namespace alidade
