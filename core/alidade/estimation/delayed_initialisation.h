// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

/// Initialisation of blocks from a measurement, by the inverse measurement model.
namespace alidade::internal {

/// Result of the inverse measurement model y = g(other roles, z, prior) for one measurement: the
/// values of the roles that its sensor initialises, and the Jacobians. Its memory can be reused for
/// the next measurement.
struct InverseMeasurement {
  std::vector<double> y;      ///< values, one role after the other
  std::vector<BlockId> from;  ///< the blocks of the other roles, x
  RowMajor by_x;              ///< J_x = dy/dx, the columns of the blocks side by side
  RowMajor by_z, by_prior;    ///< J_z, J_p
  RowMajor noise_covariance;  ///< J_z R J_z' + J_p sigma^2 J_p', p the prior

  std::vector<double> role_jacobians;         ///< J_x, block after block
  std::vector<double*> role_jacobian_starts;  ///< by role: its block in role_jacobians, or null
  RowMajor by_z_r;                            ///< J_z R
};
/// Computes y and its Jacobians, and writes y to the initialised roles in `roles`. `prior` may be
/// null if the model does not need a prior.
Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior, Roles& roles,
                 InverseMeasurement& inverse);

/// Returns whether all blocks that the sensor is bound to have a value.
bool IsReady(const FilterState& f, const PendingMeasurement& pending);

/// Evaluates the inverse measurement model at the state. `prior` may be null if the model does not
/// need a prior. Returns kAccepted, or the reason for a failure.
Outcome Invert(FilterState& f, PendingMeasurement& pending, const LandmarkOptions::Prior* prior,
               InverseMeasurement& inverse);

/// Initialises the blocks that wait for one of these measurements. Each consumes its measurement.
/// The outcome of a measurement that still needs a block without a value is kNotReady.
void InitialiseWaiting(FilterState& f, std::span<PendingMeasurement> rows);

/// Sets the block of the role that the sensor initialises to the result of Invert. Value,
/// covariance and correlations of the block are replaced.
void Initialise(FilterState& f, const PendingMeasurement& pending,
                const InverseMeasurement& inverse);

}  // namespace alidade::internal
