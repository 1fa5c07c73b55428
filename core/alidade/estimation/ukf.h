// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

/// Options of Ukf.
struct UkfOptions {
  /// Minimum of alpha. The rounding error of a mean of values y is eps |y| / (2 alpha^2), which is
  /// about 1e-8 |y| at the minimum.
  static constexpr double kMinAlpha = 1e-4;

  EkfOptions filter;   ///< gate, fuse and max_dt_s, rejection recovery
  double alpha = 0.4;  ///< spread of the sigma points, in [1e-4, 1]
  double beta = 2.0;  ///< weight of the centre in the covariance, >= 0; 2 is optimal for a Gaussian
  double kappa = 0.0;  ///< parameter of the spread c^2 = alpha^2 (N + kappa); >= 0
};

/// Unscented Kalman filter: computes the moments of y = g(x), x ~ N(x0, A A'), from 2N + 1 sigma
/// points. A is computed from the pivoted factorisation L D L' of P. P may be singular.
///
///   points     x0,  x0 (+) c a_i,  x0 (+) -c a_i        a_i: columns of A, i = 1 ... N
///   spread     c^2 = alpha^2 (N + kappa),   w = 1 / (2 c^2)
///   mean       y = g(x0) (+) m,   m = w sum f_i         f_i = g(x_i) (-) g(x0), at the mean
///   moments    Cov(y) = w sum f_i f_i' + (beta - alpha^2) m m',   Cov(x, y) = w sum dx_i f_i'
///
/// This equals the scaled transform. The large weight of the centre, which would cause rounding
/// errors, cancels in these formulas. The mean on a manifold is computed by iteration.
///
/// The state is augmented by the process noise: N = n + number of noise inputs. Discrete noise w is
/// constant over an interval. From the second step of an interval on, the points belong to (x, w)
/// with Cov(x, w) = M. Their directions are (b_i, 0), with B B' = P - M M', and (m_j, e_j).
///
/// In an update, S = Cov(h) + R and K = Cov(x, h) S^-1, with R evaluated at x0. The new P is Cov(x
/// - K h) + K R K', computed with dx_i - K f_i instead of f_i. If beta >= alpha^2, the new P is a
/// sum of squares. If the sensor has a robust loss, R / w replaces R. A joint update uses the
/// smallest spread of its measurements. The reported h, S and NIS are those that the gate used.
///
/// Sigma points may be out of domain although the model is defined at x0. On a manifold, they may
/// also be too far apart to have a mean. In both cases the spread is halved until the points can be
/// used (event `guarded`). Halving stops before alpha falls below UkfOptions::kMinAlpha. If the
/// smallest spread is still too large, the outcome of a measurement is kOutOfDomain, and a step
/// ends the filter. If h is not defined at x0, the outcome is also kOutOfDomain. If P is not
/// positive semi-definite, negative pivots are set to zero (event `repaired`).
///
/// Source       [Julier2004]; [Wan2000] alpha, beta, kappa.
class Ukf : public Filter {
 public:
  /// Does not support consider blocks or roles, blocks that start from a measurement, roles with
  /// `jacobian_at: measurement`, or landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {.recovery = true};

  /// Throws Error kBadConfig if `problem` needs more than kCapabilities, or an option is out of
  /// range.
  Ukf(Problem problem, const UkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Ukf(const Problem& problem, const UkfOptions& options = {})
      : Ukf(problem, options, problem.streams) {}
};

}  // namespace alidade
