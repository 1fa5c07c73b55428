// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

/// Initialisation of blocks from a measurement, by the inverse measurement model.
namespace alidade::internal {

/// The inverse measurement model y = g(other roles, z, prior) of one measurement: the values of the
/// roles that its sensor initialises, and the Jacobians. It keeps its memory for the next one.
struct InverseMeasurement {
  std::vector<double> y;      ///< values, one role after the other
  std::vector<BlockId> from;  ///< the blocks of the other roles
  RowMajor by_x;              ///< dy/d from, their columns side by side
  RowMajor by_z, by_prior;    ///< J_z, J_p
  RowMajor own;               ///< J_z R J_z' + J_p sigma^2 J_p', p the prior

  std::vector<double> by_role;   ///< dy/d from, one after the other
  std::vector<double*> of_role;  ///< where the Jacobian of each role lies there
  RowMajor by_z_r;               ///< J_z R
};
/// Computes y and its Jacobians, and writes y to the initialised ones of `roles`. `prior` may be
/// null if the model needs none.
Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior, Roles& roles,
                 InverseMeasurement& inverse);

/// Whether all blocks that the sensor is bound to have a value.
bool IsReady(const FilterState& f, const PendingMeasurement& pending);

/// The inverse measurement model at the state. `prior` may be null if the model needs none. Returns
/// kAccepted, or the reason for a failure.
Outcome Invert(FilterState& f, PendingMeasurement& pending, const LandmarkOptions::Prior* prior,
               InverseMeasurement& inverse);

/// Initialises the blocks that wait for one of these measurements. Each consumes its measurement. A
/// measurement that still needs a block without a value gets the outcome kNotReady.
void InitialiseWaiting(FilterState& f, std::span<PendingMeasurement> rows);

/// Sets the block of the role that the sensor initialises to the result of Invert: the value, its
/// covariance and its correlations, which replace those that it has.
void Initialise(FilterState& f, const PendingMeasurement& pending,
                const InverseMeasurement& inverse);

}  // namespace alidade::internal
