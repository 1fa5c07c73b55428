// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/time_series.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/base/statistics.h"

namespace alidade {

double AutocorrelationTime(const std::vector<double>& series, double mean) {
  const Eigen::VectorXd x = Eigen::VectorXd::Map(series.data(), std::ssize(series)).array() - mean;
  const Eigen::Index n = x.size();
  const double square = x.squaredNorm();
  if (!(square > 0.0) || !std::isfinite(square)) return 1.0;
  const auto rho = [&](Eigen::Index k) { return x.head(n - k).dot(x.tail(n - k)) / square; };
  double tau = -1.0;
  for (Eigen::Index k = 0; k + 1 < n; k += 2) {
    const double pair = rho(k) + rho(k + 1);
    if (!(pair > 0.0)) break;
    tau += 2.0 * pair;
  }
  return std::clamp(tau, 1.0, static_cast<double>(n));
}

double LagOneCorrelation(const std::vector<double>& series) {
  Eigen::VectorXd x = Eigen::VectorXd::Map(series.data(), std::ssize(series));
  x.array() -= x.mean();
  const Eigen::Index n = x.size();
  const double square = x.squaredNorm();
  return square > 0.0 ? x.head(n - 1).dot(x.tail(n - 1)) / square : 0.0;
}

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Series with its mean subtracted. sums[k] is the sum of the first k values, and
/// squares[k] is the sum of their squares.
struct CentredSeries {
  Eigen::VectorXd values, sums, squares;

  explicit CentredSeries(const std::vector<double>& series)
      : values(Eigen::VectorXd::Map(series.data(), static_cast<Eigen::Index>(series.size()))),
        sums(values.size() + 1),
        squares(values.size() + 1) {
    const double scale = values.cwiseAbs().maxCoeff();
    values.array() -= values.mean();
    // If the series is constant, only rounding errors remain.
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
  /// Returns the sum of squared deviations from the mean of the window.
  double Spread(Eigen::Index first, Eigen::Index count) const {
    const double sum = Sum(first, count);
    return squares[first + count] - squares[first] - sum * sum / static_cast<double>(count);
  }
};

/// Overlap of two series of n values, one of which is shifted by `shift`. Contains the first
/// overlapping index of each series, and the number of overlapping values.
struct Overlap {
  Eigen::Index signal, reference, count;

  Overlap(Eigen::Index n, Eigen::Index shift)
      : signal(std::max<Eigen::Index>(0, shift)),
        reference(std::max<Eigen::Index>(0, -shift)),
        count(n - std::abs(shift)) {}
};

/// Computes the correlation coefficient of reference(i) and signal(i + shift).
double Correlation(const CentredSeries& signal, const CentredSeries& reference,
                   Eigen::Index shift) {
  const Overlap o(reference.values.size(), shift);
  const double product =
      reference.values.segment(o.reference, o.count).dot(signal.values.segment(o.signal, o.count)) -
      reference.Sum(o.reference, o.count) * signal.Sum(o.signal, o.count) /
          static_cast<double>(o.count);
  const double spread = reference.Spread(o.reference, o.count) * signal.Spread(o.signal, o.count);
  return spread > 0.0 ? product / std::sqrt(spread) : kNaN;
}

/// Returns the negative mean of (reference(i) - signal(i + shift))^2.
double Closeness(const std::vector<double>& signal, const std::vector<double>& reference,
                 Eigen::Index shift) {
  const Overlap o(std::ssize(reference), shift);
  const auto r = Eigen::VectorXd::Map(reference.data() + o.reference, o.count);
  const auto s = Eigen::VectorXd::Map(signal.data() + o.signal, o.count);
  return -(r - s).squaredNorm() / static_cast<double>(o.count);
}

/// Returns whether the correlation of the series with itself is high at every shift up to `reach`.
bool IsRamp(const CentredSeries& series, Eigen::Index reach) {
  constexpr double kMinCorrelation = 0.9;
  for (Eigen::Index k = 1; k <= reach; ++k) {
    if (!(Correlation(series, series, k) > kMinCorrelation)) return false;
  }
  return true;
}

/// Fits a parabola through the largest score and its two neighbours. Returns the position of the
/// maximum of the parabola, relative to the middle of the scores. Returns NaN if a score is not
/// finite, if the first or last score is the largest, or if the largest score exceeds its
/// neighbours only by rounding errors.
double Peak(const Eigen::VectorXd& scores) {
  constexpr double kRounding = 1e-12;
  const Eigen::Index middle = scores.size() / 2;
  Eigen::Index best = 0;
  if (!scores.allFinite()) return kNaN;
  scores.maxCoeff(&best);
  if (best == 0 || best == scores.size() - 1) return kNaN;
  const double before = scores[best - 1], after = scores[best + 1];
  const double curvature = before - 2.0 * scores[best] + after;
  if (!(curvature < -kRounding)) return kNaN;
  return static_cast<double>(best - middle) + 0.5 * (before - after) / curvature;
}

}  // namespace

double Lag(const std::vector<double>& signal, const std::vector<double>& reference, double step) {
  ALIDADE_EXPECTS(signal.size() == reference.size());
  constexpr Eigen::Index kMinSize = 8, kMaxShift = 2000;
  const Eigen::Index n = static_cast<Eigen::Index>(signal.size());
  if (n < kMinSize) return kNaN;
  const CentredSeries s(signal), r(reference);
  if (!s.values.allFinite() || s.values.isZero(0.0) || r.values.isZero(0.0)) return kNaN;
  const Eigen::Index reach = std::min(n / 4, kMaxShift);
  const bool is_ramp = IsRamp(r, reach);
  const double variance = r.Spread(0, n) / static_cast<double>(n);
  Eigen::VectorXd scores(2 * reach + 1);
  for (Eigen::Index k = -reach; k <= reach; ++k) {
    scores[k + reach] = is_ramp ? Closeness(signal, reference, k) / variance : Correlation(s, r, k);
  }
  return Peak(scores) * step;
}

Settling SettlingOf(const std::vector<double>& rms) {
  constexpr std::ptrdiff_t kMinValues = 40, kReach = 4;
  constexpr double kBand = 0.2;
  const std::ptrdiff_t n = std::ssize(rms);
  if (n < kMinValues) return {kNaN, kNaN};
  std::vector<double> last(rms.begin() + n / 2, rms.end());
  std::ranges::sort(last);
  const double level = Quantile(last, 0.5);
  const auto values = Eigen::VectorXd::Map(rms.data(), n);
  // Index of the last value whose centred rms is outside the band, or -1.
  std::ptrdiff_t outside = n - kReach - 1;
  for (; outside >= 0; --outside) {
    const std::ptrdiff_t reach = std::min(outside, kReach);
    const auto window = values.segment(outside - reach, 2 * reach + 1);
    const double centred = window.norm() / std::sqrt(static_cast<double>(window.size()));
    if (!(std::abs(centred - level) <= kBand * level)) break;
  }
  const bool never_settles = outside == n - kReach - 1;
  return {level, never_settles ? std::numeric_limits<double>::infinity()
                               : static_cast<double>(outside + 2)};
}

}  // namespace alidade
