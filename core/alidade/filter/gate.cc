// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/gate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/state/small_kernels.h"

namespace alidade::internal {

Gate::Gate(const System& system, double probability) : warned_(system.sensors.size(), false) {
  for (const SensorBinding& sensor : system.sensors) {
    thresholds_.push_back(
        probability < 1.0
            ? ChiSquareQuantile(probability, sensor.model.measurement().geometry.tangent)
            : std::numeric_limits<double>::infinity());
  }
}

Outcome Gate::Pass(FilterState& f, Row& row) {
  MeasurementReport& entry = *row.report;
  if (!AllFinite(entry.s) || !AllFinite(row.PHt) || !AllFinite(entry.innovation)) {
    entry.s.clear();
    Note(f, "not_finite",
         "sensor '" + row.binding->name + "': h, H, R or the innovation is not finite");
    return Outcome::kNotFinite;
  }
  CheckConditioning(f, row);
  const auto m = static_cast<std::size_t>(entry.dof);
  memory_.resize(m * (m + 1));
  entry.nis =
      SquaredMahalanobis(entry.s.data(), entry.innovation.data(), entry.dof, memory_.data());
  if (std::isnan(entry.nis)) {
    entry.nis = 0.0;
    Note(f, "not_pd", "sensor '" + row.binding->name + "': S is not positive definite");
    return Outcome::kNotPd;
  }
  if (!(entry.nis <= thresholds_[static_cast<std::size_t>(row.sensor)])) return Outcome::kGated;
  row.weight = Weight(row.binding->loss, std::sqrt(entry.nis));
  const double widest = *std::ranges::max_element(row.R) / row.weight;
  return std::isfinite(widest) ? Outcome::kAccepted : Outcome::kGated;
}

void Gate::Weigh(Row& row) {
  if (row.weight == 1.0) return;
  for (std::size_t i = 0; i < row.R.size(); ++i) {
    const double widened = row.R[i] / row.weight;
    row.report->s[i] += widened - row.R[i];
    row.R[i] = widened;
  }
}

/// Warns once for each sensor whose noise vanishes compared with H P H'.
void Gate::CheckConditioning(FilterState& f, const Row& row) {
  const auto sensor = static_cast<std::size_t>(row.sensor);
  if (warned_[sensor]) return;
  const auto m = static_cast<std::size_t>(row.report->dof);
  double noise = 0.0, total = 0.0;
  bool tiny = false;
  for (std::size_t i = 0; i < m && !tiny; ++i) {
    noise = row.R[i * m + i];
    total = row.report->s[i * m + i];
    tiny = noise <= kVanishing * total || noise <= 0.0;
  }
  if (!tiny) return;
  warned_[sensor] = true;
  Note(f, "conditioning",
       "sensor '" + row.binding->name + "': noise variance " + RoundedText(noise, 3) +
           " vanishes compared with H P H' = " + RoundedText(total - noise, 3) +
           "; S is badly conditioned");
}

}  // namespace alidade::internal
