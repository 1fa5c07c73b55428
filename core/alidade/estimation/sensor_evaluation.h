// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem_index.h"

/// Functions that evaluate sensor models at a value x of the whole state, such as an estimate, a
/// sigma point or an iterate. m: tangent size of the measurement.
namespace alidade::internal {

/// Sets the pointers to the values of the roles of a sensor. The pointers of known roles point into
/// `known_roles`. The pointers of other roles point into x, or are null if the role has no block.
void RolesAt(const SensorPlace& place, const double* x, const double* known_roles, Roles& roles);

/// Destinations of an evaluation, row-major. A quantity is not computed if its pointer is null.
struct EvaluationOutput {
  double* h = nullptr;         ///< ambient
  double* jacobian = nullptr;  ///< H, m rows of SensorPlace::width columns; computed only with h
  double* l = nullptr;         ///< L of R = L L', m x m
};
/// Evaluates a sensor model at the values of the roles.
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

/// Computes R, m x m, row-major, at the values of the roles. If the measurement has a covariance,
/// copies the covariance to R instead. `l` is temporary memory with the size of R.
Outcome NoiseAt(const SensorModel& model, const SensorPlace& place, const Measurement& measurement,
                const double* const* roles, double* l, double* r);

}  // namespace alidade::internal
