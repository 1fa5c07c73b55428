// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

/// Functions that initialise blocks from a measurement with the inverse measurement model.
namespace alidade::internal {

/// Result of the inverse measurement model y = g(x, z, p) for one measurement z: the values y of
/// the roles that the sensor initialises, and the Jacobians of y. x are the values of the other
/// roles. p is the prior value, with the standard deviation sigma. The object can be reused for the
/// next measurement without allocating memory.
struct InverseMeasurement {
  std::vector<double> y;      ///< concatenated values of the initialised roles
  std::vector<BlockId> from;  ///< the blocks of the other roles, x
  RowMajor by_x;              ///< J_x = dy/dx, with the columns of all blocks side by side
  RowMajor by_z, by_prior;    ///< J_z = dy/dz and J_p = dy/dp
  RowMajor noise_covariance;  ///< J_z R J_z' + J_p sigma^2 J_p'

  std::vector<double> role_jacobians;         ///< J_x as one matrix for each block, concatenated
  std::vector<double*> role_jacobian_starts;  ///< by role: start in role_jacobians, or null
  RowMajor by_z_r;                            ///< J_z R
};
/// Computes y and its Jacobians. Sets the pointers of the initialised roles in `roles` to the
/// values in y. `prior` may be null if the model does not need a prior.
Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior, Roles& roles,
                 InverseMeasurement& inverse);

/// Returns whether all blocks that the sensor is bound to have a value.
bool IsReady(const FilterState& f, const PendingMeasurement& pending);

/// Evaluates the inverse measurement model at the current state. `prior` may be null if the model
/// does not need a prior. Returns kAccepted, or the reason for a failure.
Outcome Invert(FilterState& f, PendingMeasurement& pending, const LandmarkOptions::Prior* prior,
               InverseMeasurement& inverse);

/// Initialises the blocks that wait for one of the measurements `rows`. A measurement that
/// initialises a block is not used for the update. If a block of the sensor still has no value, the
/// outcome of the measurement is kNotReady.
void InitialiseWaiting(FilterState& f, std::span<PendingMeasurement> rows);

/// Initialises the block of the role that the sensor determines. `inverse` is the result of Invert.
/// Replaces the value, covariance and correlations of the block.
void Initialise(FilterState& f, const PendingMeasurement& pending,
                const InverseMeasurement& inverse);

}  // namespace alidade::internal
