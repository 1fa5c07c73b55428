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
/// Prediction and update each need one QR factorisation, without computing Q. m: total tangent size
/// of the measurements, n: size of P.
///
///   predict   [F L, G Lq]' = Q [L+ 0]'                                     (n + n_w) x n
///   update    [Lr  H L]    [Ls  0 ]
///             [0   L  ]  = [W   L+] Q'                                     (m + n) x (m + n)
///             S = Ls Ls',  dx = W Ls^-1 r,  K = W Ls^-1
///
/// For discrete noise w, which is constant over an interval, the filter stores M = Cov(x, w) and
/// the root B of P - M M'. Each step computes M <- F M + G Lq. B is computed by the prediction
/// equation above, from F B and the continuous noise. L is the triangular factor of [B M].
///
/// Jacobians and robust weights are computed as in Ekf. The complexity of an update is O((m +
/// n)^3).
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

  /// Returns L, n x n. ContractViolation if a filter of another type was assigned to this filter.
  /// state().covariance() is L L' in double precision and has half as many correct digits as L.
  const Eigen::MatrixXd& root() const;
};

}  // namespace alidade
