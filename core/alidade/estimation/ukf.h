// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/estimation/filter.h"

namespace alidade {

/// Options of Ukf.
struct UkfOptions {
  /// The rounding error of the mean of values y is eps |y| / (2 alpha^2): 1e-8 |y| with this alpha.
  static constexpr double kMinAlpha = 1e-4;

  EkfOptions filter;    ///< gate, fuse and max_dt_s; `rejection_recovery` counts as kNone
  double alpha = 0.01;  ///< spread of the sigma points, in [1e-4, 1]
  double beta = 2.0;    ///< weight of the centre in the covariance, >= 0; 2: best for a Gaussian
  double kappa = 0.0;   ///< spread beyond the number of directions, >= 0
};

/// Unscented Kalman filter: computes the moments of y = g(x), x ~ N(x0, A A'), from 2N + 1 sigma
/// points. A comes from the pivoted L D L' of P, which may be singular.
///
///   points     x0,  x0 (+) c a_i,  x0 (+) -c a_i        a_i: columns of A, i = 1 ... N
///   spread     c^2 = alpha^2 (N + kappa),   w = 1 / (2 c^2)
///   mean       y = g(x0) (+) m,   m = w sum f_i         f_i = g(x_i) (-) g(x0), at the mean
///   moments    Cov(y) = w sum f_i f_i' + (beta - alpha^2) m m',   Cov(x, y) = w sum dx_i f_i'
///
/// This is the scaled transform without its large weight of the centre, which cancels. The mean on
/// a manifold is computed by iteration.
///
/// Process noise is augmented: N = n + noise inputs. Discrete noise w is constant over an interval.
/// From its second step on, the points are those of (x, w) with Cov(x, w) = M, in the directions
/// (b_i, 0), B B' = P - M M', and (m_j, e_j).
///
/// R of a measurement is evaluated at x0; S = Cov(h) + R, K = Cov(x, h) S^-1. The new P is
/// Cov(x - K h) + K R K', computed with dx_i - K f_i instead of f_i; if beta >= alpha^2 it is a sum
/// of squares. With a robust loss, R / w replaces R. A joint update uses the smallest spread of its
/// measurements; the reported h, S and NIS are those of the gate.
///
/// Sigma points may leave the domain of a model that is defined at x0, or be too far apart on a
/// manifold to have a mean. Their spread is then halved until neither occurs (event `guarded`), as
/// long as alpha is above 1e-4 because of rounding (UkfOptions::kMinAlpha). If that is not
/// sufficient, a measurement is out of domain, and a step ends the filter. A sensor that is not
/// defined at x0 is out of domain. If P is not positive semi-definite, negative pivots count
/// as zero (event `repaired`).
///
/// Source       [Julier2004]; [Wan2000] alpha, beta, kappa.
class Ukf : public Filter {
 public:
  /// No consider blocks or roles, no blocks that start from a measurement, no roles with
  /// `jacobian_at: measurement`, no rejection recovery, no landmarks.
  static constexpr EstimatorCapabilities kCapabilities = {};

  /// Errors: kBadConfig if `problem` asks for more than kCapabilities or an option is out of its
  /// range.
  Ukf(Problem problem, const UkfOptions& options, const std::vector<StreamInfo>& streams);
  explicit Ukf(const Problem& problem, const UkfOptions& options = {})
      : Ukf(problem, options, problem.streams) {}
};

}  // namespace alidade
