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
  return InfoOf(entry.outcome).is_rejection &&
         (entry.outcome != Outcome::kNotFinite || !entry.h.empty());
}

}  // namespace

Gate::Gate(const Problem& problem, const EkfOptions& options)
    : gates_(options.gate < 1.0),
      warned_(problem.sensors.size(), false),
      rejections_(problem.sensors.size(), 0),
      most_rejections_(options.rejection_recovery == RejectionRecovery::kNone
                           ? 0
                           : options.rejection_recovery_after) {
  for (const SensorBinding& sensor : problem.sensors) {
    weighs_ |= sensor.loss.kind != LossKind::kNone;
    thresholds_.push_back(
        gates_ ? ChiSquareQuantile(options.gate, sensor.model->measurement().geometry.tangent)
               : std::numeric_limits<double>::max());
  }
}

/// Of a row whose NIS is too large, infinite or not a number.
[[gnu::noinline]] Outcome Gate::Refuse(FilterState& f, PendingMeasurement& pending, double nis) {
  if (!std::isfinite(nis)) {
    const Outcome outcome = Defect(f, pending);
    if (outcome != Outcome::kAccepted) return outcome;
    if (!gates_ && !std::isnan(nis)) return Pass(f, pending, nis);
  }
  CheckConditioning(f, pending);
  pending.report->nis = std::isnan(nis) ? 0.0 : nis;
  if (!std::isnan(nis)) return Outcome::kGated;
  Note(f, "not_pd", "sensor '" + pending.binding->name + "': S is not positive definite");
  return Outcome::kNotPd;
}

[[gnu::noinline]] Outcome Gate::Weigh(PendingMeasurement& pending, double nis) {
  pending.weight = Weight(pending.binding->loss, std::sqrt(nis));
  if (pending.weight == 1.0) return Outcome::kAccepted;
  const double widest = *std::ranges::max_element(pending.R) / pending.weight;
  return std::isfinite(widest) ? Outcome::kAccepted : Outcome::kGated;
}

/// kNotFinite if a number of the row is not finite, else kAccepted.
Outcome Gate::Defect(FilterState& f, PendingMeasurement& pending) {
  MeasurementReport& entry = *pending.report;
  const char* const what = !AllFinite(entry.h)            ? "h"
                           : !AllFinite(pending.H)        ? "H"
                           : !AllFinite(pending.R)        ? "R"
                           : !AllFinite(entry.innovation) ? "the innovation"
                           : !AllFinite(entry.s)          ? "S = H P H' + R"
                                                          : nullptr;
  if (what == nullptr) return Outcome::kAccepted;
  entry.s = {};
  Note(f, "not_finite", "sensor '" + pending.binding->name + "': " + what + " is not finite");
  return Outcome::kNotFinite;
}

void Gate::ApplyRobustWeights(std::span<PendingMeasurement* const> rows) const {
  if (!weighs_) return;
  for (PendingMeasurement* const pending : rows) {
    if (pending->weight == 1.0) continue;
    for (std::size_t i = 0; i < pending->R.size(); ++i) {
      const double widened = pending->R[i] / pending->weight;
      pending->s[i] += widened - pending->R[i];
      pending->R[i] = widened;
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
[[gnu::noinline]] void Gate::WarnOfConditioning(FilterState& f, const PendingMeasurement& pending,
                                                std::size_t i) {
  const auto sensor = static_cast<std::size_t>(pending.sensor);
  if (warned_[sensor]) return;
  warned_[sensor] = true;
  Note(f, "conditioning",
       "sensor '" + pending.binding->name + "': noise variance " + RoundedText(pending.R[i], 3) +
           " vanishes compared with H P H' = " + RoundedText(pending.s[i] - pending.R[i], 3) +
           "; S is badly conditioned");
}

}  // namespace alidade::internal
