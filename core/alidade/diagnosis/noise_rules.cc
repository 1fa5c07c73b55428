// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/diagnosis/diagnosis_rules.h"
#include "alidade/diagnosis/time_series.h"

namespace alidade::internal {
namespace {

/// Threshold of a normal variable: a two-sided probability of 1.6e-6.
constexpr double kMaxNormal = 4.8;

/// Statistic of one element of the measurement.
struct ElementStatistic {
  double normal = 0.0;  ///< normal with mean 0 and variance 1 if the rule finds nothing
  double value = 0.0;   ///< for the text
  std::size_t element = 0;
};

/// Returns the statistic with the largest |normal| over the elements.
template <class Statistic>
ElementStatistic Largest(const InnovationView& view, const Statistic& statistic) {
  ElementStatistic largest;
  for (std::size_t k = 0; k < view.dof(); ++k) {
    ElementStatistic candidate = statistic(view, k);
    candidate.element = k;
    if (std::abs(candidate.normal) > std::abs(largest.normal)) largest = candidate;
  }
  return largest;
}

/// Returns sum u_k / sqrt(n) of the n tested measurements of each frame.
std::vector<double> FrameInnovations(const InnovationView& view, std::size_t k) {
  std::vector<double> series;
  for (const FrameSum& frame :
       SumFrames(view, view.tested(), [&](std::size_t i) { return view.u(i, k); })) {
    series.push_back(frame.sum / std::sqrt(frame.count));
  }
  return series;
}

/// Returns the autocorrelation time of a series about its mean.
double CorrelationTime(const std::vector<double>& series) {
  return AutocorrelationTime(series, Mean(series));
}

/// Returns the normal value with about the same probability as the value t of Student's
/// distribution with n - 1 degrees of freedom.
double NormalOfStudent(double t, double n) {
  const double dof = std::max(n - 1.0, 1.0);
  return t * (1.0 - 0.25 / dof) / std::sqrt(1.0 + 0.5 * t * t / dof);
}

/// Mean of the innovation, in sigma. The uncertainty of the mean allows for correlation in time.
ElementStatistic BiasOf(const InnovationView& view, std::size_t k) {
  const std::vector<double> series = FrameInnovations(view, k);
  const auto n = static_cast<double>(series.size());
  const double variance = std::max(SquaredDeviation(series) / (n - 1.0), 1e-24);
  const double independent = n / CorrelationTime(series);
  double mean = 0.0;
  for (const std::size_t i : view.tested()) mean += view.u(i, k);
  return {NormalOfStudent(Mean(series) / std::sqrt(variance / independent), independent),
          mean / static_cast<double>(view.tested().size())};
}

ElementStatistic CorrelationOf(const InnovationView& view, std::size_t k) {
  const std::vector<double> series = FrameInnovations(view, k);
  const double rho = LagOneCorrelation(series);
  return {rho * std::sqrt(static_cast<double>(series.size())), rho};
}

/// Regression line of y against x by least squares.
struct Line {
  double slope = 0.0;
  double normal = 0.0;    ///< slope divided by its standard deviation
  double x_spread = 0.0;  ///< standard deviation of x
};

/// Computes the line of y against x. Row i of the view belongs to x_i and y_i. The variance of the
/// slope allows for dependence in a frame, because its innovations depend on the same prediction,
/// and in time. Returns the slope 0 if x is constant.
Line FitLine(const InnovationView& view, const Rows& rows, const std::vector<double>& x,
             const std::vector<double>& y) {
  const double mean_x = Mean(x), mean_y = Mean(y), square = SquaredDeviation(x);
  if (!(square > 1e-12 * (square + mean_x * mean_x))) return {};
  double product = 0.0;
  for (std::size_t j = 0; j < x.size(); ++j) product += (x[j] - mean_x) * (y[j] - mean_y);
  const double slope = product / square;
  std::vector<double> scores;  // sums over frames
  double residual_square = 0.0, score_square = 0.0;
  for (std::size_t j = 0; j < x.size(); ++j) {
    const bool is_new = j == 0 || view.frame(rows[j]) != view.frame(rows[j - 1]);
    if (is_new) scores.push_back(0.0);
    const double residual = y[j] - mean_y - slope * (x[j] - mean_x);
    const double score = (x[j] - mean_x) * residual;
    scores.back() += score;
    residual_square += residual * residual;
    score_square += score * score;
  }
  double frame_square = 0.0;
  for (const double score : scores) frame_square += score * score;
  const auto n = static_cast<double>(x.size());
  const double dependence = std::max(1.0, frame_square / score_square) * CorrelationTime(scores);
  return {slope, product / std::sqrt(square * residual_square / n * dependence),
          std::sqrt(square / n)};
}

/// Innovations, and the rates of their predictions.
struct RateSamples {
  Rows rows;
  std::vector<double> rate;  ///< dh/dt / sqrt(S), 1/s
  std::vector<double> u;
  std::vector<double> step_s;  ///< time to the previous measurement
};

/// Computes the rate of h by the difference to the previous measurement of the same landmark. Such
/// a rate does not depend on the innovation, so that both are independent in a consistent filter. A
/// central difference would depend on it. Returns no samples if several measurements of a frame
/// have the same landmark, or none, because the previous measurement is then ambiguous.
RateSamples RatesOf(const InnovationView& view, std::size_t k) {
  RateSamples samples;
  std::map<std::int64_t, std::size_t> previous;  // row of the last measurement, by landmark
  for (const std::size_t i : view.tested()) {
    const auto [entry, is_first] = previous.try_emplace(view.series().landmarks[i], i);
    const std::size_t before = std::exchange(entry->second, i);
    const double step_s = view.time_s(i) - view.time_s(before);
    if (!is_first && step_s == 0.0) return {};
    if (is_first || !(step_s > 0.0)) continue;
    samples.rows.push_back(i);
    samples.rate.push_back(view.Difference(view.h(i, k), view.h(before, k), k) / step_s /
                           view.s(i, k));
    samples.u.push_back(view.u(i, k));
    samples.step_s.push_back(step_s);
  }
  return samples;
}

/// Slope of u against the rate, in s. Returns 0 if the offset is too small to matter, or longer
/// than kMaxSteps time steps: other errors also make innovations proportional to the rate.
ElementStatistic OffsetOf(const InnovationView& view, std::size_t k) {
  constexpr std::size_t kMinSamples = 30;
  constexpr double kMinSigmas = 0.1, kMaxSteps = 3.0;
  if (!view.has_z(k)) return {};
  const RateSamples samples = RatesOf(view, k);
  if (samples.rows.size() <= kMinSamples) return {};
  const Line line = FitLine(view, samples.rows, samples.rate, samples.u);
  const double offset_s = std::abs(line.slope);
  if (!(offset_s * line.x_spread > kMinSigmas)) return {};
  if (offset_s > kMaxSteps * Median(samples.step_s)) return {};
  return {line.normal, line.slope};
}

/// Ratio of the mean of a squared innovation to its expected value.
struct Scale {
  double ratio = 1.0;
  double independent = 1.0;  ///< number of independent frames

  ScaleTest Test(double dof) const { return TestScale(ratio, dof, independent); }
  /// Returns the factor of the innovations.
  double factor() const { return std::sqrt(ratio); }
};

/// Computes the ratio from the means of value(i) over frames. The innovations of a consistent
/// filter are white. Their autocorrelation time is therefore limited to kMaxTime; otherwise a
/// persistent error would hide itself.
template <class Value>
Scale ScaleOf(const InnovationView& view, const Rows& rows, const Value& value) {
  constexpr double kMaxTime = 5.0;
  const std::vector<double> means = FrameMeans(view, rows, value);
  if (means.empty()) return {};
  return {Mean(means),
          static_cast<double>(means.size()) / std::min(CorrelationTime(means), kMaxTime)};
}

/// Returns the mean NIS of a quarter of the rows, from index `begin`.
double QuarterMean(const InnovationView& view, const Rows& rows, std::size_t begin) {
  double sum = 0.0;
  const std::size_t count = rows.size() / 4;
  for (std::size_t j = 0; j < count; ++j) sum += view.nis(rows[begin + j]);
  return sum / static_cast<double>(count);
}

/// Returns the accepted measurements without those of the first frames.
Rows AcceptedRows(const InnovationView& view) {
  Rows rows;
  for (const std::size_t i : view.tested()) {
    if (view.is_accepted(i)) rows.push_back(i);
  }
  return rows;
}

}  // namespace

std::optional<Finding> TestNoiseModel(const InnovationView& view) {
  constexpr double kMaxNis = 16.0, kMinNis = 1e-12, kMinSpread = 0.05;
  constexpr std::size_t kMinFrames = 60;
  if (view.dof() != 1 || !view.has_z(0)) return {};
  Rows rows;
  std::vector<double> size, nis;  // log |h|, and the NIS up to kMaxNis
  for (const std::size_t i : view.inliers()) {
    if (view.h(i, 0) == 0.0 || view.nis(i) <= kMinNis) continue;
    rows.push_back(i);
    size.push_back(std::log(std::abs(view.h(i, 0))));
    nis.push_back(std::min(view.nis(i), kMaxNis));
  }
  if (CountFrames(view, rows) <= kMinFrames) return {};
  const Line line = FitLine(view, rows, size, nis);
  if (!(line.x_spread > kMinSpread && std::abs(line.normal) > kMaxNormal)) return {};
  std::ranges::sort(rows, {}, [&](std::size_t i) { return std::abs(view.h(i, 0)); });
  return MakeFinding(
      FindingKind::kHeteroscedastic, view, line.normal,
      "the NIS is " + RoundedText(QuarterMean(view, rows, 0), 3) +
          " at the smallest quarter of the predictions and " +
          RoundedText(QuarterMean(view, rows, rows.size() - rows.size() / 4), 3) +
          " at the largest: the noise depends on the measured quantity in another way than in the "
          "model; choose another noise model");
}

std::optional<Finding> TestTails(const InnovationView& view) {
  if (!view.has_outliers() || view.series().has_robust_loss) return {};
  return MakeFinding(
      FindingKind::kHeavyTails, view, view.outlier_share(),
      RoundedText(100.0 * view.outlier_share(), 2) +
          " % of the innovations are outliers, and 0.01 % are expected; " +
          (view.rejected().empty()
               ? "use `gate`, `loss: {huber: 1.345}` or `outlier_rejection`"
               : "the gate rejects some of them; find their cause, or use `loss: {huber: 1.345}`"));
}

std::optional<Finding> TestElements(const InnovationView& view) {
  constexpr double kMinContrast = 1.6, kMinFactor = 1.3;
  if (view.dof() < 2) return {};
  double smallest = std::numeric_limits<double>::infinity(), largest = 0.0, worst = 1.0;
  std::string list;
  for (std::size_t k = 0; k < view.dof(); ++k) {
    const Scale scale =
        ScaleOf(view, view.inliers(), [&](std::size_t i) { return view.u(i, k) * view.u(i, k); });
    const double factor = scale.factor();
    smallest = std::min(smallest, factor);
    largest = std::max(largest, factor);
    const bool is_wrong = std::abs(std::log(factor)) > std::log(kMinFactor);
    if (!is_wrong || scale.Test(1.0) == ScaleTest::kPassed) continue;
    list += (list.empty() ? "" : ", ") + RoundedText(factor, 3) + " for element " +
            std::to_string(k) + UnitHint(factor, view.innovation_unit(k));
    if (std::abs(std::log(factor)) > std::abs(std::log(worst))) worst = factor;
  }
  if (list.empty() || !(largest > kMinContrast * smallest)) return {};
  return MakeFinding(FindingKind::kElement, view, worst,
                     "the ratio of the innovations to their predicted size depends on the element: "
                     "it is " +
                         list +
                         "; multiply the sigma of each of these elements by its ratio and check "
                         "its unit, or change the process noise");
}

std::optional<Finding> TestTimeOffset(const InnovationView& view) {
  constexpr double kMinNormal = 6.0, kMinCorrelation = -0.1;
  const ElementStatistic offset = Largest(view, OffsetOf);
  if (!(std::abs(offset.normal) > kMinNormal)) return {};
  if (Largest(view, CorrelationOf).value <= kMinCorrelation) return {};
  return MakeFinding(FindingKind::kTimeOffset, view, offset.normal,
                     ElementPrefix(view, offset.element) +
                         "innovations are proportional to the rate of the prediction, as if "
                         "measurements were made " +
                         RoundedText(1e3 * std::abs(offset.value), 3) + " ms " +
                         (offset.value > 0.0 ? "after" : "before") +
                         " their timestamps; check the clocks: add " +
                         RoundedText(offset.value, 2) +
                         " to `time_offset_s` of this sensor or subtract it from that of another "
                         "one, or estimate it, because the true value may be larger");
}

std::optional<Finding> TestBias(const InnovationView& view) {
  constexpr double kMinSigmas = 0.1;
  const ElementStatistic bias = Largest(view, BiasOf);
  if (!(std::abs(bias.normal) > kMaxNormal && std::abs(bias.value) > kMinSigmas)) return {};
  double mean = 0.0;
  for (const std::size_t i : view.tested()) mean += view.r(i, bias.element);
  mean /= static_cast<double>(view.tested().size());
  return MakeFinding(FindingKind::kBias, view, bias.normal,
                     ElementPrefix(view, bias.element) + "the mean innovation is " +
                         RoundedText(mean, 3) + " (" + RoundedText(bias.value, 3) +
                         " sigma), and 0 is expected: the sensor has a bias, or an extrinsic or a "
                         "calibration is wrong; correct it or estimate it");
}

std::optional<Finding> TestCorrelation(const InnovationView& view) {
  constexpr double kMinCorrelation = 0.15;
  const ElementStatistic rho = Largest(view, CorrelationOf);
  if (!(std::abs(rho.normal) > kMaxNormal && std::abs(rho.value) > kMinCorrelation)) return {};
  const bool is_positive = rho.value > 0.0;
  return MakeFinding(
      is_positive ? FindingKind::kCorrelated : FindingKind::kAnticorrelated, view, rho.normal,
      ElementPrefix(view, rho.element) + "successive innovations have the correlation " +
          RoundedText(rho.value, 2) + ", and 0 is expected: " +
          (is_positive ? "the filter corrects too little: the process noise is too small, sigma is "
                         "too large, or the model lacks a motion or a bias; increase the process "
                         "noise, decrease sigma, or estimate the bias"
                       : "the filter corrects too much: the process noise is too large, or sigma "
                         "is too small; decrease the process noise or increase sigma"));
}

std::optional<Finding> TestScaleOfNis(const InnovationView& view) {
  if (view.series().has_robust_loss) return {};
  const int dof = view.series().dof;
  const double expected = dof * view.expected_nis();
  const auto relative_nis = [&](std::size_t i) { return view.nis(i) / expected; };
  const Scale scale = ScaleOf(view, view.inliers(), relative_nis);
  const ScaleTest test = scale.Test(dof);
  if (test != ScaleTest::kTooLarge) {
    const Scale all = ScaleOf(view, AcceptedRows(view), relative_nis);
    if (all.Test(dof) == ScaleTest::kTooLarge) {
      return MakeFinding(FindingKind::kOverconfident, view, all.factor(),
                         "the mean NIS is " + RoundedText(all.ratio, 3) +
                             " times its expected value, because some innovations are far too "
                             "large; look for jumps and outliers of the sensor");
    }
  }
  if (test == ScaleTest::kPassed) return {};
  const double factor = scale.factor();
  const bool is_large = test == ScaleTest::kTooLarge;
  const FindingKind kind = is_large ? FindingKind::kOverconfident : FindingKind::kUnderconfident;
  const std::string size = "innovations are " + RoundedText(factor, 3) +
                           " times as large as predicted" +
                           (view.dof() == 1 ? UnitHint(factor, view.innovation_unit(0)) : "");
  if (TestElements(view)) {
    return MakeFinding(kind, view, factor, size + "; this ratio depends on the element");
  }
  const char* const map =
      is_large && view.series().has_landmark_prior
          ? "; if the camera moved slowly at first, near and far landmarks may instead be "
            "exchanged: add landmarks later by `landmarks.prior.min_observations: 30`"
          : "";
  return MakeFinding(kind, view, factor,
                     size + ", so sigma or the process noise is too " +
                         (is_large ? "small" : "large") + "; multiply sigma by about " +
                         RoundedText(factor, 2) + ", or change the process noise" + map);
}

}  // namespace alidade::internal
