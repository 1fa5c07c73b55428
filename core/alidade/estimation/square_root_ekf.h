// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"
#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Extended Kalman filter that carries a square root L of the covariance, P = L L', so that P is
/// positive semi-definite whatever rounding does, with twice the digits. Both steps are one QR
/// factorisation, of which the orthogonal factor is not needed; m rows of measurements, P n x n.
///
///   predict   [F L, G Lq]' = Q [L+ 0]'                                     (n + n_w) x n
///   update    [Lr  H L]    [Ls  0 ]
///             [0   L  ]  = [W   L+] Q'                                     (m + n) x (m + n)
///             S = Ls Ls',  dx = W Ls^-1 r,  K = W Ls^-1
///
/// Of discrete noise w, held over an interval, it carries M = Cov(x, w) and the root B of P - M M'.
/// Each step takes B <- F B (with continuous noise as above) and M <- F M + G Lq; L is the triangle
/// of [B M].
///
/// All Jacobians are those of Ekf, and so is the weight of a robust loss, R / w for R.
/// O((m + n)^3) for each update.
///
/// Source       [Bierman1977] ch. V; [Kailath2000] sec. 12.3, the array form.
class SquareRootEkf : public Filter {
 public:
  /// No consider blocks and roles, none that start or are linearised at a measurement, no
  /// rejection recovery, no landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {};

  /// `options.rejection_recovery` counts as kNone. Errors: kBadConfig if `problem` asks for more
  /// than kCapabilities.
  SquareRootEkf(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit SquareRootEkf(const Problem& problem, const EkfOptions& options = {})
      : SquareRootEkf(problem, options, problem.streams) {}

  /// L, n x n; ContractViolation where another kind of filter was assigned. state().covariance() is
  /// L L' in double precision, and so has half its digits.
  const Eigen::MatrixXd& root() const;
};

}  // namespace alidade
