// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/digits_lost.h"

#include <cstddef>

#include "alidade/base/number_text.h"

namespace alidade::internal {
namespace {

/// Smallest ratio of a variance to the terms of which it is the sum. The rounding error of an
/// update is then eps / kSmallestRatio = 0.4 % of the variance. The errors of later updates add to
/// it.
constexpr double kSmallestRatio = 5e-14;

/// Reports that `variance` is too small compared with `terms`.
[[gnu::noinline]] void Report(FilterState& f, const PendingMeasurement& pending, double variance,
                              double terms) {
  char& is_reported = f.health.digits_lost[static_cast<std::size_t>(pending.sensor)];
  if (is_reported != 0) return;
  is_reported = 1;
  AddEvent(
      f, EventKind::kDigitsLost,
      "sensor '" + pending.binding->name + "': the variance " + RoundedText(variance, 3) +
          " of a measurement is lost by rounding, because the states contribute variances of " +
          RoundedText(terms, 3) +
          "; sigmas may be wrong by more than 1 %; use square_root_ekf or a narrower prior");
}

}  // namespace

void CheckDigits(FilterState& f, const PendingMeasurement& pending, const double* inverse_d) {
  const JacobianRows& h = pending.linearised.h;
  const Covariance& p = f.state.covariance();
  const auto width = static_cast<std::size_t>(h.width());
  for (std::size_t i = 0; i < static_cast<std::size_t>(h.rows); ++i) {
    double terms = 0.0;
    for (std::size_t j = 0; j < width; ++j) {
      const double derivative = h.data[i * width + j];
      terms += derivative * derivative * p.Variance(h.columns[j]);
    }
    const std::size_t diagonal = i * static_cast<std::size_t>(h.rows + 1);
    if (pending.R[diagonal] < kSmallestRatio * terms) {
      return Report(f, pending, pending.R[diagonal], terms);
    }
    if (kSmallestRatio * pending.s[diagonal] * inverse_d[i] > 1.0) {
      return Report(f, pending, 1.0 / inverse_d[i], pending.s[diagonal]);
    }
  }
}

}  // namespace alidade::internal
