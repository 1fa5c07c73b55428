// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/diagnosis/diagnosis_rules.h"

namespace alidade::internal {
namespace {

/// Factor between two units that are easily confused.
struct UnitFactor {
  double factor;
  const char* meaning;
  std::array<std::string_view, 3> units;  ///< units of the quantities to which the factor applies
};
constexpr UnitFactor kUnitFactors[] = {
    {1e3, "the factor between mm and m, or between ms and s", {"m", "m/s", "s"}},
    {100.0, "the factor between cm and m", {"m", "m/s"}},
    {180.0 / std::numbers::pi, "the factor between degrees and rad", {"rad", "rad/s"}},
    {3.6, "the factor between km/h and m/s", {"m/s"}},
    {1e9, "the factor between ns and s", {"s"}},
    {1e6, "the factor between um and m, or between us and s", {"m", "s"}},
    {3.28084, "the factor between feet and m", {"m"}},
    {60.0, "the factor between minutes and s", {"s"}},
};

/// Returns the factor f for which |ratio| is nearest to f or 1 / f, or null if none is near. A
/// large factor may differ by e^0.35, because the measured quantity may differ from its prediction
/// too. A small factor must be exact. `with_small` admits small factors. `unit` is the unit of the
/// quantity; "" admits all factors.
const UnitFactor* NearestFactor(double ratio, bool with_small, std::string_view unit = "") {
  constexpr double kLargeFactor = 20.0, kLargeTolerance = 0.35, kSmallTolerance = 0.05;
  const UnitFactor* nearest = nullptr;
  double smallest = kLargeTolerance;
  for (const UnitFactor& candidate : kUnitFactors) {
    if (!unit.empty() && std::ranges::count(candidate.units, unit) == 0) continue;
    const double distance = std::abs(std::abs(std::log(ratio)) - std::log(candidate.factor));
    const bool is_large = candidate.factor > kLargeFactor;
    if ((!is_large && (!with_small || distance > kSmallTolerance)) || !(distance < smallest)) {
      continue;
    }
    nearest = &candidate;
    smallest = distance;
  }
  return nearest;
}

std::optional<Finding> UnitFinding(const InnovationView& view, std::size_t k, double ratio,
                                   const std::string& measurement, const std::string& meaning) {
  return MakeFinding(FindingKind::kUnit, view, ratio,
                     ElementPrefix(view, k) + measurement + " is " + RoundedText(ratio, 4) +
                         " times its prediction, which is " + meaning +
                         "; check the unit of the data, of the prior and of the parameters");
}

/// Compares the first measurement, to which no update has adapted the state yet, with the
/// prediction by the prior. If the prediction may be 0, a large ratio has no meaning.
std::optional<Finding> TestFirstRatio(const InnovationView& view) {
  for (std::size_t k = 0; k < view.dof(); ++k) {
    if (!view.has_z(k)) continue;
    const double ratio = view.z(0, k) / view.h(0, k);
    const bool may_be_zero = std::abs(view.h(0, k)) <= view.s(0, k);
    if (!(ratio > 0.0) || !std::isfinite(ratio) || (ratio > 1.0 && may_be_zero)) continue;
    if (const UnitFactor* const unit = NearestFactor(ratio, false)) {
      return UnitFinding(view, k, ratio, "the first measurement", unit->meaning);
    }
  }
  return {};
}

/// Returns measurements that are far from their predictions: the rejected ones, or, if there are
/// fewer than three, the first ones. At most kMaxRows.
Rows FarRows(const InnovationView& view) {
  constexpr std::size_t kMinRows = 3, kMaxRows = 60, kMaxFirst = 30;
  Rows rows = view.rejected();
  if (rows.size() < kMinRows) {
    rows.resize(std::min(view.size(), std::clamp(view.size() / 10, kMinRows, kMaxFirst)));
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = i;
  }
  rows.resize(std::min(rows.size(), kMaxRows));
  return rows;
}

/// Compares the ratios z / h of several measurements, which have to agree.
std::optional<Finding> TestMedianRatio(const InnovationView& view) {
  constexpr std::size_t kMinRatios = 3;
  constexpr double kLargeSpread = 0.3, kSmallSpread = 0.05;
  const Rows rows = FarRows(view);
  for (std::size_t k = 0; k < view.dof(); ++k) {
    if (!view.has_z(k)) continue;
    std::vector<double> ratios, distances;
    for (const std::size_t i : rows) {
      const double ratio = view.z(i, k) / view.h(i, k);
      if (std::isfinite(ratio) && ratio != 0.0) ratios.push_back(ratio);
    }
    if (ratios.size() < kMinRatios) continue;
    const double median = Median(ratios);
    for (const double ratio : ratios)
      distances.push_back(std::abs(std::log(std::abs(ratio / median))));
    const double spread = Median(distances);
    if (!(spread < kLargeSpread)) continue;
    if (median < 0.0) {
      const bool is_opposite = spread <= kSmallSpread && std::abs(median + 1.0) <= kSmallSpread;
      if (!is_opposite || view.is_angle(k)) continue;  // pi and -pi are the same angle
      return MakeFinding(FindingKind::kUnit, view, median,
                         ElementPrefix(view, k) +
                             "the measurement is -1 times its prediction; check the sign and the "
                             "direction of the axis");
    }
    if (const UnitFactor* const unit = NearestFactor(median, spread < kSmallSpread)) {
      return UnitFinding(view, k, median, "the measurement", unit->meaning);
    }
  }
  return {};
}

/// Detects a latitude and a longitude that are read as metres: they hardly vary, compared with
/// sigma.
std::optional<Finding> TestDegreesAsMetres(const InnovationView& view) {
  constexpr std::size_t kMinSize = 10;
  constexpr double kMaxVariation = 0.01, kLimits[] = {90.0, 180.0};
  if (view.size() < kMinSize || view.dof() < 2) return {};
  double variation = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    if (!view.has_z(k) || view.unit(k) != "m") return {};
    std::vector<double> values, sigmas;
    for (std::size_t i = 0; i < view.size(); ++i) {
      values.push_back(view.z(i, k));
      sigmas.push_back(view.s(i, k));
    }
    const auto [low, high] = std::ranges::minmax(values);
    if (low < -kLimits[k] || high > kLimits[k] || low == high) return {};
    variation = std::max(variation, (high - low) / Median(std::move(sigmas)));
  }
  if (!(variation < kMaxVariation)) return {};
  return MakeFinding(FindingKind::kUnit, view, variation,
                     "elements 0 and 1 begin at " + RoundedText(view.z(0, 0), 6) + " and " +
                         RoundedText(view.z(0, 1), 6) + ", and vary by only " +
                         RoundedText(variation, 2) +
                         " sigma: degrees read as metres? convert latitude and longitude to "
                         "local metres");
}

/// Returns whether the first measurements differ from their predictions by more than 8 sigma.
bool StartsFarOff(const InnovationView& view) {
  constexpr std::size_t kMinRows = 5;
  constexpr double kFar = 8.0;
  std::vector<double> nis(view.series().nis);
  nis.resize(std::min(view.size(), std::max(kMinRows, view.size() / 10)));
  return Median(std::move(nis)) > kFar * kFar * view.series().dof;
}

bool IsMostlyRejected(const InnovationView& view) { return view.rejected_share() > 0.5; }

/// Returns the length of the longest sequence of frames in which most measurements were rejected.
std::size_t LongestRejection(const InnovationView& view) {
  Rows all(view.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  std::size_t longest = 0, current = 0;
  for (const double share :
       FrameMeans(view, all, [&](std::size_t i) { return view.is_accepted(i) ? 0.0 : 1.0; })) {
    current = share > 0.5 ? current + 1 : 0;
    longest = std::max(longest, current);
  }
  return longest;
}

/// Root mean squares of u over two elements: as measured, and after the elements of z were
/// exchanged.
struct SwapEffect {
  double before, after;
};
SwapEffect EffectOfSwap(const InnovationView& view, std::size_t i, std::size_t a, std::size_t b) {
  const double swapped_a = view.Difference(view.z(i, b), view.h(i, a), a) / view.s(i, a);
  const double swapped_b = view.Difference(view.z(i, a), view.h(i, b), b) / view.s(i, b);
  return {std::hypot(view.u(i, a), view.u(i, b)) / std::numbers::sqrt2,
          std::hypot(swapped_a, swapped_b) / std::numbers::sqrt2};
}

/// Returns the medians of both over the measurements that are far from their predictions.
SwapEffect MedianEffectOfSwap(const InnovationView& view, std::size_t a, std::size_t b) {
  constexpr double kFar = 5.0;
  std::vector<double> before, after;
  for (std::size_t i = 0; i < view.size(); ++i) {
    if (view.is_accepted(i) && view.frame(i) >= kFirstFrames) continue;
    const SwapEffect effect = EffectOfSwap(view, i, a, b);
    if (!(effect.before > kFar)) continue;
    before.push_back(effect.before);
    after.push_back(effect.after);
  }
  if (before.empty()) return {0.0, 0.0};
  return {Median(std::move(before)), Median(std::move(after))};
}

}  // namespace

std::string UnitHint(double ratio, const std::string& unit) {
  const UnitFactor* const factor = NearestFactor(ratio, false, unit);
  return factor ? std::string(" (near ") + factor->meaning + ')' : "";
}

std::optional<Finding> TestTimeUnit(const InnovationView& view) {
  constexpr double kLongStep_s = 10.0, kFarRatio = 20.0;
  const InnovationSeries& series = view.series();
  if (series.frames < 2) return {};
  const double step_s =
      (Seconds(series.last) - Seconds(series.first)) / (static_cast<double>(series.frames) - 1.0);
  if (!(step_s > kLongStep_s)) return {};
  const double ratio = view.median_ratio();
  const bool is_far = ratio > kFarRatio || ratio < 1.0 / kFarRatio || TestPrior(view) ||
                      TestDomain(view) || TestRejections(view);
  if (!is_far) return {};
  return MakeFinding(FindingKind::kTimeUnit, view, step_s,
                     "the mean time step is " + RoundedText(step_s, 3) +
                         " s, and the innovations are not as predicted: the times may be in ms; "
                         "convert them to s");
}

std::optional<Finding> TestUnit(const InnovationView& view) {
  if (view.size() == 0) return {};
  if (std::optional<Finding> finding = TestDegreesAsMetres(view)) return finding;
  const bool is_prior_far = TestPrior(view).has_value();
  if (is_prior_far) {
    if (std::optional<Finding> finding = TestFirstRatio(view)) return finding;
  }
  if (!is_prior_far && !IsMostlyRejected(view) && !StartsFarOff(view)) return {};
  return TestMedianRatio(view);
}

std::optional<Finding> TestPrior(const InnovationView& view) {
  constexpr double kFalseAlarm = 1e-6, kMaxRatio = 16.0;
  double count = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < view.size() && view.frame(i) < kFirstFrames; ++i, ++count) {
    // A rejection does not change the prior. If it suits the next measurement, this is an outlier.
    const bool is_outlier = !view.is_accepted(i) && i + 1 < view.size() && view.is_accepted(i + 1);
    if (!is_outlier) largest = std::max(largest, view.nis(i));
  }
  if (count == 0.0) return {};
  const int dof = view.series().dof;
  // If all innovations are too large, the first ones are not due to the prior.
  const double ratio = std::clamp(view.median_ratio(), 1.0, kMaxRatio);
  if (!(largest > ratio * ChiSquareQuantile(1.0 - kFalseAlarm / count, dof))) return {};
  return MakeFinding(FindingKind::kPriorFar, view, largest,
                     "one of the first measurements is " +
                         RoundedText(std::sqrt(largest / dof), 3) +
                         " sigma from its prediction: the prior is too narrow, or a unit, a frame "
                         "or an extrinsic is wrong; check these, or increase the sigma of the "
                         "prior");
}

std::optional<Finding> TestDomain(const InnovationView& view) {
  const InnovationSeries& series = view.series();
  const double share = static_cast<double>(series.out_of_domain) /
                       static_cast<double>(std::max<std::int64_t>(series.total, 1));
  if (!(share > 0.5)) return {};
  return MakeFinding(FindingKind::kOutOfDomain, view, share,
                     "the sensor model is not defined at the estimate for " +
                         RoundedText(100.0 * share, 3) +
                         " % of the measurements: the estimate is "
                         "lost; check the prior, the units and the times");
}

std::optional<Finding> TestRejections(const InnovationView& view) {
  constexpr std::size_t kMinRows = 5, kMaxInARow = 10;
  constexpr const char* kRemedy =
      "; check the prior, the units, the noise of the sensor, the process noise and the gate";
  const double share = view.rejected_share();
  if (IsMostlyRejected(view) && view.size() >= kMinRows) {
    return MakeFinding(
        FindingKind::kRejected, view, share,
        RoundedText(100.0 * share, 3) + " % of the measurements were rejected" + kRemedy);
  }
  const std::size_t longest = LongestRejection(view);
  if (longest < kMaxInARow) return {};
  return MakeFinding(FindingKind::kRejected, view, static_cast<double>(longest),
                     "most measurements of " + std::to_string(longest) +
                         " consecutive timestamps were rejected" + kRemedy);
}

std::optional<Finding> TestSwap(const InnovationView& view) {
  constexpr double kMinGain = 5.0, kMaxAfter = 5.0;
  for (std::size_t a = 0; a < view.dof(); ++a) {
    for (std::size_t b = a + 1; b < view.dof(); ++b) {
      if (!view.has_z(a) || !view.has_z(b)) continue;
      if (view.unit(a).empty() || view.unit(a) != view.unit(b)) continue;
      const auto [before, after] = MedianEffectOfSwap(view, a, b);
      if (!(after < kMaxAfter && before > kMinGain * after)) continue;
      return MakeFinding(FindingKind::kSwapped, view, before / after,
                         "elements " + std::to_string(a) + " and " + std::to_string(b) + " are " +
                             RoundedText(before, 3) + " sigma from their predictions, but " +
                             RoundedText(after, 3) +
                             " sigma after an exchange of both elements; check their order");
    }
  }
  return {};
}

std::optional<Finding> TestStuck(const InnovationView& view) {
  constexpr std::size_t kMinRepetitions = 20;
  const InnovationSeries& series = view.series();
  const auto size = static_cast<std::size_t>(series.ambient);
  for (std::size_t element = 0; element < size; ++element) {
    std::size_t longest = 0, current = 0;
    double since_s = 0.0;
    for (std::size_t i = 1; i < view.size(); ++i) {
      const double* const z = &series.z[i * size + element];
      const bool is_same = series.landmarks[i] < 0 && z[0] == *(z - size);
      current = is_same ? current + 1 : 0;
      if (current <= longest) continue;
      longest = current;
      since_s = view.time_s(i - current);
    }
    // A sensor that always measures the same, such as zero velocity, is not stuck.
    if (longest < kMinRepetitions || longest + 1 == view.size()) continue;
    return MakeFinding(FindingKind::kStuck, view, static_cast<double>(longest),
                       (size == 1 ? "" : "element " + std::to_string(element) + " of ") +
                           "the measurement at " + RoundedText(since_s, 6) + " s was repeated " +
                           std::to_string(longest) +
                           " times without a change: the sensor is stuck, or its resolution is "
                           "coarser than its noise; leave out these measurements");
  }
  return {};
}

}  // namespace alidade::internal
