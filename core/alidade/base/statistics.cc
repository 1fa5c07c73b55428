// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include "alidade/base/error.h"

namespace alidade {
namespace {

/// Returns y^a e^-y / Gamma(a).
double GammaKernel(double a, double y) {
  constexpr double kSmall = 10.0;
  if (a <= kSmall) return std::pow(y, a) * std::exp(-y) / std::tgamma(a);
  // Stirling's series approximates ln Gamma(a); its first omitted term is below 1e-15. The two
  // large terms of the exponent are combined to a (ln(y / a) - mu).
  const double mu = (y - a) / a, square = 1.0 / (a * a);
  const double log_ratio = mu < -0.5 ? std::log(y / a) : std::log1p(mu);
  constexpr double kSeries[] = {1.0 / 12.0,    -1.0 / 360.0, 1.0 / 1260.0,
                                -1.0 / 1680.0, 1.0 / 1188.0, -691.0 / 360360.0};
  double stirling = 0.0, power = 1.0 / a;
  for (const double coefficient : kSeries) {
    stirling += coefficient * power;
    power *= square;
  }
  return std::sqrt(a / (2.0 * std::numbers::pi)) * std::exp(a * (log_ratio - mu) - stirling);
}

/// Probabilities that a chi-square variable is below x and above x.
struct Tails {
  double below, above;
};

/// Returns the regularised incomplete gamma functions P(a, y) and Q(a, y), a = dof / 2, y = x / 2
/// [Press2007, sec. 6.2]. If y < a + 1, the function sums the series of P; otherwise, it evaluates
/// the continued fraction of Q. The other value is the complement to 1.
Tails ChiSquareTails(double x, double dof) {
  const double a = 0.5 * dof, y = 0.5 * x;
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  if (!(y > 0.0)) return {0.0, 1.0};
  const double kernel = GammaKernel(a, y);
  if (y < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (double k = a + 1.0; term > 0.1 * kEpsilon * sum; k += 1.0) sum += term *= y / k;
    return {kernel * sum, 1.0 - kernel * sum};
  }
  // Lentz's method. The denominators are not zero, because y > a - 1.
  double b = y + 1.0 - a, c = std::numeric_limits<double>::max(), d = 1.0 / b, fraction = d;
  for (double k = 1.0, factor = 0.0; std::abs(factor - 1.0) > kEpsilon; k += 1.0) {
    b += 2.0;
    d = 1.0 / (k * (a - k) * d + b);
    c = b + k * (a - k) / c;
    factor = c * d;
    fraction *= factor;
  }
  return {1.0 - kernel * fraction, kernel * fraction};
}

}  // namespace

double ChiSquareQuantile(double q, double dof) {
  ALIDADE_EXPECTS(q >= 0.0 && q <= 1.0 && dof > 0.0);
  if (q == 0.0) return 0.0;
  if (q == 1.0) return std::numeric_limits<double>::infinity();
  // Uses the smaller tail probability, because the larger one may round to 1.
  const auto is_below = [q, dof](double x) {
    const Tails tails = ChiSquareTails(x, dof);
    return q <= 0.5 ? tails.below < q : tails.above > 1.0 - q;
  };
  double low = 0.0, high = dof;
  while (is_below(high)) {
    low = high;
    high *= 2.0;
  }
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return high;
    (is_below(middle) ? low : high) = middle;
  }
}

double TruncatedMean(double dof, double cut) {
  ALIDADE_EXPECTS(dof > 0.0 && cut > 0.0);
  if (std::isinf(cut)) return 1.0;
  // The densities satisfy x chi2(x; dof) = dof chi2(x; dof + 2).
  return ChiSquareTails(cut, dof + 2.0).below / ChiSquareTails(cut, dof).below;
}

Interval ConsistencyBounds(double dof, double n, double cut) {
  ALIDADE_EXPECTS(dof > 0.0 && n > 0.0 && cut > 0.0);
  double m = 1.0, v = 2.0 / dof;
  if (std::isfinite(cut)) {
    m = TruncatedMean(dof, cut);
    v = (dof + 2.0) / dof * m * TruncatedMean(dof + 2.0, cut) - m * m;
  }
  const double nu = 2.0 * n * m * m / v;
  return {m * ChiSquareQuantile(0.025, nu) / nu, m * ChiSquareQuantile(0.975, nu) / nu};
}

ScaleTest TestScale(double mean, double dof, double n, double p) {
  constexpr double kSmallestFactor = 1.15 * 1.15;
  const double nu = n * dof;
  if (mean >= kSmallestFactor && mean > ChiSquareQuantile(1.0 - p, nu) / nu) {
    return ScaleTest::kTooLarge;
  }
  if (mean <= 1.0 / kSmallestFactor && mean < ChiSquareQuantile(p, nu) / nu) {
    return ScaleTest::kTooSmall;
  }
  return ScaleTest::kPassed;
}

double Quantile(const std::vector<double>& ascending, double q) {
  ALIDADE_EXPECTS(!ascending.empty() && q >= 0.0 && q <= 1.0);
  const double h = static_cast<double>(ascending.size() - 1) * q;
  const auto index = static_cast<std::size_t>(h);
  const double low = ascending[index];
  const double high = ascending[std::min(index + 1, ascending.size() - 1)];
  const double fraction = h - static_cast<double>(index);
  // The difference of two equal infinities would be NaN.
  return fraction == 0.0 || low == high ? low : low + fraction * (high - low);
}

Interval ShareInterval(std::int64_t successes, std::int64_t trials) {
  constexpr double kQuantile = 1.959963984540054;
  const auto n = static_cast<double>(trials);
  const double share = static_cast<double>(successes) / n, z2 = kQuantile * kQuantile / n;
  const double centre = share + z2 / 2.0;
  const double half = kQuantile * std::sqrt(share * (1.0 - share) / n + z2 / (4.0 * n));
  return {std::max(0.0, (centre - half) / (1.0 + z2)), std::min(1.0, (centre + half) / (1.0 + z2))};
}

double Median(std::vector<double> values) {
  std::ranges::sort(values);
  return Quantile(values, 0.5);
}

double Mean(std::span<const double> values) {
  ALIDADE_EXPECTS(!values.empty());
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double SquaredDeviation(std::span<const double> values) {
  const double mean = Mean(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum;
}

Spread SpreadOf(std::vector<double> values) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return {kNaN, kNaN, kNaN, kNaN};
  std::ranges::sort(values);
  return {Mean(values), Quantile(values, 0.05), Quantile(values, 0.5), Quantile(values, 0.95),
          values.size()};
}

}  // namespace alidade
