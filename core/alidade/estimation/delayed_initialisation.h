// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

/// Blocks that take their value from a measurement, by the inverse measurement model.
namespace alidade::internal {

/// What a measurement tells of the roles that its sensor initialises: y = g(other roles, z, prior).
/// One that is used again for the same sensor keeps its memory.
struct InverseMeasurement {
  std::vector<double> y;      ///< values, one role after the other
  std::vector<BlockId> from;  ///< the blocks that it took
  RowMajor by_x;              ///< dy/d from, their columns side by side
  RowMajor by_z, by_prior;    ///< J_z, J_p
  RowMajor own;               ///< of a row: J_z R J_z' + J_p sigma^2 J_p', p the prior

  std::vector<double> by_role;   ///< dy/d from, one after the other
  std::vector<double*> of_role;  ///< where the Jacobian of each role lies there
  RowMajor by_z_r;               ///< J_z R
};
/// y and its Jacobians. Of `roles` those that the sensor initialises are y afterwards. `prior` may
/// be null where the model needs none.
Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior, Roles& roles,
                 InverseMeasurement& inverse);

/// Whether all blocks that a row's sensor is bound to have a value.
bool IsReady(const FilterState& f, const PendingMeasurement& pending);

/// The inverse of a row's measurement at the state. `prior` may be null where the model needs none.
/// kAccepted, or why not.
Outcome Invert(FilterState& f, PendingMeasurement& pending, const LandmarkOptions::Prior* prior,
               InverseMeasurement& inverse);

/// Initialises the blocks that wait for one of these measurements, each consuming its measurement;
/// what then still needs a block without a value is not ready.
void InitialiseWaiting(FilterState& f, std::span<PendingMeasurement> rows);

/// Gives the block of the sensor's initialised role what the measurement implies, the row's inverse
/// at the state: the value, its covariance and correlations, in place of any that it has.
void Initialise(FilterState& f, const PendingMeasurement& pending,
                const InverseMeasurement& inverse);

}  // namespace alidade::internal
