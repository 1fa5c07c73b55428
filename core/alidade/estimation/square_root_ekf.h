// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Extended Kalman filter that propagates a square root L of the covariance, P = L L'. P is then
/// positive semi-definite despite rounding, and L has twice the digits. Prediction and update are
/// one QR factorisation each, without the orthogonal factor. m: rows of measurements, P: n x n.
///
///   predict   [F L, G Lq]' = Q [L+ 0]'                                     (n + n_w) x n
///   update    [Lr  H L]    [Ls  0 ]
///             [0   L  ]  = [W   L+] Q'                                     (m + n) x (m + n)
///             S = Ls Ls',  dx = W Ls^-1 r,  K = W Ls^-1
///
/// For discrete noise w, which is constant over an interval, it stores M = Cov(x, w) and the root B
/// of P - M M'. Each step computes B <- F B (with continuous noise as above) and M <- F M + G Lq. L
/// is the triangular factor of [B M].
///
/// Jacobians and robust weights are those of Ekf. Complexity of an update: O((m + n)^3).
///
/// Source       [Bierman1977] ch. V; [Kailath2000] sec. 12.3, the array form.
class SquareRootEkf : public Filter {
 public:
  /// No consider blocks or roles, no blocks that start from a measurement, no roles with
  /// `jacobian_at: measurement`, no rejection recovery, no landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {};

  /// `options.rejection_recovery` counts as kNone. Errors: kBadConfig if `problem` asks for more
  /// than kCapabilities.
  SquareRootEkf(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit SquareRootEkf(const Problem& problem, const EkfOptions& options = {})
      : SquareRootEkf(problem, options, problem.streams) {}

  /// Returns L, n x n. ContractViolation if a filter of another type was assigned to this one.
  /// state().covariance() is L L' in double precision, with half the digits of L.
  const Eigen::MatrixXd& root() const;
};

}  // namespace alidade
