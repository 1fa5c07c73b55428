// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <limits>
#include <vector>

#include "alidade/error.h"
#include "alidade/metrics.h"

namespace alidade {

double ChiSquareQuantile(double q, int dof) {
  ALIDADE_EXPECTS(q >= 0.0 && q <= 1.0 && dof > 0);
  if (q == 1.0) return std::numeric_limits<double>::infinity();
  return boost::math::quantile(boost::math::chi_squared(dof), q);
}

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A series less its mean, with the sums of its first k values and squares.
struct Centred {
  Eigen::VectorXd values, sums, squares;

  explicit Centred(const std::vector<double>& series)
      : values(Eigen::VectorXd::Map(series.data(), static_cast<Eigen::Index>(series.size()))),
        sums(values.size() + 1),
        squares(values.size() + 1) {
    const double scale = values.cwiseAbs().maxCoeff();
    values.array() -= values.mean();
    // What is left of a constant is rounding.
    if (!(values.cwiseAbs().maxCoeff() > 1e-13 * scale)) values.setZero();
    sums[0] = squares[0] = 0.0;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      sums[i + 1] = sums[i] + values[i];
      squares[i + 1] = squares[i] + values[i] * values[i];
    }
  }
  double Sum(Eigen::Index first, Eigen::Index count) const {
    return sums[first + count] - sums[first];
  }
  /// Sum of squares about the mean of the window.
  double Spread(Eigen::Index first, Eigen::Index count) const {
    const double sum = Sum(first, count);
    return squares[first + count] - squares[first] - sum * sum / static_cast<double>(count);
  }
};

/// Correlation coefficient of reference(i) and signal(i + shift) over all i where both are.
double Correlation(const Centred& signal, const Centred& reference, Eigen::Index shift) {
  const Eigen::Index n = reference.values.size() - std::abs(shift);
  const Eigen::Index r = std::max<Eigen::Index>(0, -shift), s = std::max<Eigen::Index>(0, shift);
  const double product = reference.values.segment(r, n).dot(signal.values.segment(s, n)) -
                         reference.Sum(r, n) * signal.Sum(s, n) / static_cast<double>(n);
  const double spread = reference.Spread(r, n) * signal.Spread(s, n);
  return spread > 0.0 ? product / std::sqrt(spread) : kNaN;
}

}  // namespace

double Lag(const std::vector<double>& signal, const std::vector<double>& reference, double step) {
  ALIDADE_EXPECTS(signal.size() == reference.size());
  constexpr Eigen::Index kMinSize = 8, kMaxShift = 2000;
  const Eigen::Index n = static_cast<Eigen::Index>(signal.size());
  if (n < kMinSize) return kNaN;
  const Centred s(signal), r(reference);
  if (!s.values.allFinite() || s.values.isZero(0.0) || r.values.isZero(0.0)) return kNaN;
  const Eigen::Index reach = std::min(n / 4, kMaxShift);
  Eigen::VectorXd correlation(2 * reach + 1);
  for (Eigen::Index k = -reach; k <= reach; ++k) correlation[k + reach] = Correlation(s, r, k);
  if (!correlation.allFinite()) return kNaN;
  Eigen::Index best = 0;
  correlation.maxCoeff(&best);
  double shift = static_cast<double>(best - reach);
  if (best > 0 && best < 2 * reach) {
    const double before = correlation[best - 1], after = correlation[best + 1];
    const double curvature = before - 2.0 * correlation[best] + after;
    if (curvature < 0.0) shift += 0.5 * (before - after) / curvature;
  }
  return shift * step;
}

}  // namespace alidade
