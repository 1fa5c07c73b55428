// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem_index.h"

/// Evaluation of sensor models at values x of the whole state, such as the estimate of a filter, an
/// iterate, a sigma point or an iterate of a batch. m: tangent size of the measurement.
namespace alidade::internal {

/// Sets the pointers to the values of the roles of a sensor: in x, or in `known_roles` for known
/// roles. The pointer of a role without a block is null.
void RolesAt(const SensorPlace& place, const double* x, const double* known_roles, Roles& roles);

/// Destinations of an evaluation, row-major; null: not computed.
struct EvaluationOutput {
  double* h = nullptr;         ///< ambient
  double* jacobian = nullptr;  ///< H, m rows of the width of the place; requires h
  double* l = nullptr;         ///< of R = L L', m x m
};
/// Evaluates a sensor model at the roles.
Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   const EvaluationOutput& output);

/// Computes R = L L', m x m, row-major.
inline void Square(const double* l, int m, double* r) {
  if (m == 1) {
    r[0] = l[0] * l[0];
    return;
  }
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
}

/// Computes R at the roles, or copies the covariance of the measurement, m x m, row-major. `l` is
/// temporary memory of the same size.
Outcome NoiseAt(const SensorModel& model, const SensorPlace& place, const Measurement& measurement,
                const double* const* roles, double* l, double* r);

}  // namespace alidade::internal
