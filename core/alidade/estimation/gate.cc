// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/gate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"

namespace alidade::internal {
namespace {

/// A measurement that is itself not finite, of which no h was asked, tells nothing of the filter.
bool IsRejected(const MeasurementReport& entry) {
  const Outcome outcome = entry.outcome;
  return outcome == Outcome::kGated || outcome == Outcome::kOutOfDomain ||
         outcome == Outcome::kNotPd || (outcome == Outcome::kNotFinite && !entry.h.empty());
}

}  // namespace

Gate::Gate(const System& system, const EkfOptions& options)
    : gates_(options.gate < 1.0),
      warned_(system.sensors.size(), false),
      rejections_(system.sensors.size(), 0),
      most_rejections_(options.rejection_recovery == RejectionRecovery::kNone
                           ? 0
                           : options.rejection_recovery_after) {
  for (const SensorBinding& sensor : system.sensors) {
    weighs_ |= sensor.loss.kind != LossKind::kNone;
    thresholds_.push_back(
        gates_ ? ChiSquareQuantile(options.gate, sensor.model->measurement().geometry.tangent)
               : std::numeric_limits<double>::max());
  }
}

/// Of a row whose NIS is too large, infinite or not a number.
[[gnu::noinline]] Outcome Gate::Refuse(FilterState& f, Row& row, double nis) {
  if (!std::isfinite(nis)) {
    const Outcome outcome = Defect(f, row);
    if (outcome != Outcome::kAccepted) return outcome;
    if (!gates_ && !std::isnan(nis)) return Pass(f, row, nis);
  }
  CheckConditioning(f, row);
  row.report->nis = std::isnan(nis) ? 0.0 : nis;
  if (!std::isnan(nis)) return Outcome::kGated;
  Note(f, "not_pd", "sensor '" + row.binding->name + "': S is not positive definite");
  return Outcome::kNotPd;
}

[[gnu::noinline]] Outcome Gate::Weigh(Row& row, double nis) {
  row.weight = Weight(row.binding->loss, std::sqrt(nis));
  if (row.weight == 1.0) return Outcome::kAccepted;
  const double widest = *std::ranges::max_element(row.R) / row.weight;
  return std::isfinite(widest) ? Outcome::kAccepted : Outcome::kGated;
}

/// kNotFinite if a number of the row is not finite, else kAccepted.
Outcome Gate::Defect(FilterState& f, Row& row) {
  MeasurementReport& entry = *row.report;
  const char* const what = !AllFinite(entry.h)            ? "h"
                           : !AllFinite(row.H)            ? "H"
                           : !AllFinite(row.R)            ? "R"
                           : !AllFinite(entry.innovation) ? "the innovation"
                           : !AllFinite(entry.s)          ? "S = H P H' + R"
                                                          : nullptr;
  if (what == nullptr) return Outcome::kAccepted;
  entry.s = {};
  Note(f, "not_finite", "sensor '" + row.binding->name + "': " + what + " is not finite");
  return Outcome::kNotFinite;
}

void Gate::ApplyRobustWeights(std::span<Row* const> rows) const {
  if (!weighs_) return;
  for (Row* const row : rows) {
    if (row->weight == 1.0) continue;
    for (std::size_t i = 0; i < row->R.size(); ++i) {
      const double widened = row->R[i] / row->weight;
      row->s[i] += widened - row->R[i];
      row->R[i] = widened;
    }
  }
}

/// Of a measurement that was not accepted. Whether its sensor has to recover.
[[gnu::noinline]] bool Gate::CountRejection(const MeasurementReport& entry) {
  if (most_rejections_ == 0 || !IsRejected(entry)) return false;
  int& count = rejections_[static_cast<std::size_t>(entry.sensor)];
  if (++count < most_rejections_) return false;
  count = 0;
  return true;
}

/// Once for each sensor whose noise vanishes compared with H P H'.
[[gnu::noinline]] void Gate::WarnOfConditioning(FilterState& f, const Row& row, std::size_t i) {
  const auto sensor = static_cast<std::size_t>(row.sensor);
  if (warned_[sensor]) return;
  warned_[sensor] = true;
  Note(f, "conditioning",
       "sensor '" + row.binding->name + "': noise variance " + RoundedText(row.R[i], 3) +
           " vanishes compared with H P H' = " + RoundedText(row.s[i] - row.R[i], 3) +
           "; S is badly conditioned");
}

}  // namespace alidade::internal
