// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/gate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/statistics.h"

namespace alidade::internal {
Gate::Gate(const Problem& problem, const EkfOptions& options) : has_gate_(options.gate < 1.0) {
  for (const SensorBinding& sensor : problem.sensors) {
    has_robust_loss_ |= sensor.loss.kind != LossKind::kNone;
    thresholds_.push_back(
        has_gate_ ? ChiSquareQuantile(options.gate, sensor.model->measurement().geometry.tangent)
                  : std::numeric_limits<double>::max());
  }
}

/// Handles a measurement whose NIS is too large, infinite or NaN.
[[gnu::noinline]] Outcome Gate::Reject(FilterState& f, PendingMeasurement& pending, double nis) {
  if (!std::isfinite(nis)) {
    const Outcome outcome = CheckFinite(f, pending);
    if (outcome != Outcome::kAccepted) return outcome;
    if (!has_gate_ && !std::isnan(nis)) return Accept(pending, nis);
  }
  pending.report->nis = std::isnan(nis) ? 0.0 : nis;
  if (!std::isnan(nis)) return Outcome::kGated;
  AddEvent(f, EventKind::kNotPd,
           "sensor '" + pending.binding->name + "': S is not positive definite");
  return Outcome::kNotPd;
}

[[gnu::noinline]] Outcome Gate::ComputeRobustWeight(PendingMeasurement& pending, double nis) {
  pending.weight = Weight(pending.binding->loss, std::sqrt(nis));
  if (pending.weight == 1.0) return Outcome::kAccepted;
  const double widest = *std::ranges::max_element(pending.R) / pending.weight;
  return std::isfinite(widest) ? Outcome::kAccepted : Outcome::kGated;
}

/// Returns kNotFinite if h, H, R, r or S of the measurement is not finite, else kAccepted.
Outcome Gate::CheckFinite(FilterState& f, PendingMeasurement& pending) {
  MeasurementReport& entry = *pending.report;
  const char* const quantity = !AllFinite(entry.h)            ? "h"
                               : !AllFinite(pending.H)        ? "H"
                               : !AllFinite(pending.R)        ? "R"
                               : !AllFinite(entry.innovation) ? "the innovation"
                               : !AllFinite(entry.s)          ? "S = H P H' + R"
                                                              : nullptr;
  if (quantity == nullptr) return Outcome::kAccepted;
  entry.s = {};
  AddEvent(f, EventKind::kNotFinite,
           "sensor '" + pending.binding->name + "': " + quantity + " is not finite");
  return Outcome::kNotFinite;
}

void Gate::ApplyRobustWeights(std::span<PendingMeasurement* const> rows) const {
  if (!has_robust_loss_) return;
  for (PendingMeasurement* const pending : rows) {
    if (pending->weight == 1.0) continue;
    for (std::size_t i = 0; i < pending->R.size(); ++i) {
      const double widened = pending->R[i] / pending->weight;
      pending->s[i] += widened - pending->R[i];
      pending->R[i] = widened;
    }
  }
}

}  // namespace alidade::internal
