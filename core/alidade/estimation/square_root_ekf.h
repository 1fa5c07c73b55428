// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Extended Kalman filter that propagates a square root L of the covariance, P = L L'. P is then
/// positive semi-definite despite rounding errors, and L has twice as many correct digits as P.
/// Prediction and update multiply an array by Householder reflections, whose product Q is
/// orthogonal. m: total tangent size of the measurements, n: size of P, n_w: number of noise
/// inputs.
///
///   predict   [F L  G Lq] Q = [L+ 0]                                       n x (n + n_w)
///   update    [Lr  H L] Q = [Ls  0 ]
///             [0   L  ]     [W   L+]                                       (m + n) x (m + n)
///             S = Ls Ls',  dx = W Ls^-1 r,  K = W Ls^-1
///
/// For discrete noise w, which is constant over an interval, the filter stores M = Cov(x, w) and
/// the root B of P - M M'. Each step computes M <- F M + G Lq. B is computed by the prediction
/// equation above, from F B and the continuous noise. L is the triangular factor of [M B].
///
/// Jacobians and robust weights are computed as in Ekf. The complexity is O(n^2 (n + n_w)) for a
/// prediction and O(n m (n + m)) for an update.
///
/// Source       [Bierman1977] ch. V; [Kailath2000] sec. 12.3, the array form.
class SquareRootEkf : public Filter {
 public:
  /// Does not support consider blocks or roles, blocks that start from a measurement, roles with
  /// `jacobian_at: measurement`, or landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {.recovery = true};

  /// Throws Error kBadConfig if
  /// `problem` needs more than kCapabilities.
  SquareRootEkf(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit SquareRootEkf(const Problem& problem, const EkfOptions& options = {})
      : SquareRootEkf(problem, options, problem.streams) {}

  /// Returns the square root of P: L, n x n, or [M B] in an interval of discrete noise.
  /// ContractViolation if a filter of another type was assigned to this filter.
  /// state().covariance() is computed from the root in double precision. It has half as many
  /// correct digits as the root.
  Eigen::MatrixXd root() const;
};

}  // namespace alidade
