// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/sensor_evaluation.h"

#include <algorithm>
#include <array>

namespace alidade::internal {

void RolesAt(const SensorPlace& place, const double* x, const double* known_roles, Roles& roles) {
  for (std::size_t i = 0, count = place.values.size(); i < count; ++i) {
    const int at = place.values[i];
    roles[i] = at < 0 ? nullptr : (place.known[i] != 0 ? known_roles : x) + at;
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   const EvaluationOutput& to) {
  std::array<double*, kMaxRoles> jacobians;
  SensorModel::Output output{to.h, nullptr, nullptr, to.l};
  if (to.jacobian != nullptr) {
    for (std::size_t i = 0, count = place.columns.size(); i < count; ++i) {
      jacobians[i] = place.columns[i] < 0 ? nullptr : to.jacobian + place.columns[i];
    }
    output.jacobians = jacobians.data();
    output.strides = place.strides.data();
  }
  return OutcomeOf(
      model.Evaluate({measurement.values.data(), measurement.known.data()}, roles, output));
}

Outcome NoiseAt(const SensorModel& model, const SensorPlace& place, const Measurement& measurement,
                const double* const* roles, double* l, double* r) {
  if (!measurement.covariance.empty()) {
    std::ranges::copy(measurement.covariance, r);
    return Outcome::kAccepted;
  }
  const Outcome outcome = EvaluateAt(model, place, measurement, roles, {.l = l});
  Square(l, place.dof, r);
  return outcome;
}

}  // namespace alidade::internal
