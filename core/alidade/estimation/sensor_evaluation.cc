// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/sensor_evaluation.h"

#include <algorithm>
#include <array>

namespace alidade::internal {

void RolesAt(const SensorPlace& place, const double* x, const double* known_roles, Roles& roles) {
  for (std::size_t i = 0, count = place.values.size(); i < count; ++i) {
    const int offset = place.values[i];
    roles[i] = offset < 0 ? nullptr : (place.is_known[i] != 0 ? known_roles : x) + offset;
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   const EvaluationOutput& output) {
  std::array<double*, kMaxRoles> jacobians;
  SensorModel::Output model_output{output.h, nullptr, nullptr, output.l};
  if (output.jacobian != nullptr) {
    for (std::size_t i = 0, count = place.columns.size(); i < count; ++i) {
      jacobians[i] = place.columns[i] < 0 ? nullptr : output.jacobian + place.columns[i];
    }
    model_output.jacobians = jacobians.data();
    model_output.strides = place.strides.data();
  }
  return OutcomeOf(
      model.Evaluate({measurement.values.data(), measurement.known.data()}, roles, model_output));
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
