// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

/// Options of Iekf.
struct IekfOptions : EkfOptions {
  int max_iterations = 10;  ///< maximum number of linearisations of an update; at least 2
  /// An update has converged if its next step is at most this, in posterior standard deviations;
  /// > 0.
  double tolerance = 1e-4;
};

/// Iterated extended Kalman filter [Bell1993]: an Ekf with updates that minimise
///
///   c(dx) = dx' P^-1 dx + r' R^-1 r,   r = z (-) h(x (+) dx)
///
/// over dx by Gauss-Newton; P is the covariance of the prediction. Each iteration computes, with
/// H = d h / d dx at the iterate,
///
///   dx+ = K (r + H dx),   K = P H' S^-1,   S = H P H' + R
///
/// and halves the step dx+ - dx while c rises or h is not defined. R is evaluated at the iterate
/// and constant during a step. The covariance is P - K S K' of the last linearisation. Gate and
/// robust weight are computed at the prediction, and so are the reported h, S and NIS.
///
/// If an update does not converge, or reaches a point at which h has no Jacobian, the last iterate
/// is used and the event `not_converged` reports it. If R is not positive definite, c does not
/// exist, and the update is that of the Ekf.
class Iekf : public Filter {
 public:
  /// No consider blocks or roles, no roles with `jacobian_at: measurement`.
  static constexpr EstimatorCapabilities kCapabilities = {
      .from_measurement = true, .recovery = true, .landmarks = true};

  /// Errors: kBadConfig if `problem` asks for more than kCapabilities, `jacobian` is not kLatest or
  /// an option is out of its range.
  Iekf(Problem problem, const IekfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Iekf(const Problem& problem, const IekfOptions& options = {})
      : Iekf(problem, options, problem.streams) {}
};

}  // namespace alidade
