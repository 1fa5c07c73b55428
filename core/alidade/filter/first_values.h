// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "alidade/filter/filter_state.h"

/// Blocks that take their value from a measurement, by the inverse measurement model.
namespace alidade::internal {

/// Whether all blocks that a row's sensor is bound to have a value.
bool IsReady(const FilterState& f, const Row& row);

/// The inverse of a row's measurement at the state. `prior` may be null where the model needs none.
/// kAccepted, or why not.
Outcome Invert(FilterState& f, Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse);

/// Initialises the blocks that wait for one of these measurements, each consuming its measurement;
/// what then still needs a block without a value is not ready.
void InitialiseWaiting(FilterState& f, std::span<Row> rows);

/// Gives the block of the sensor's initialised role what the measurement implies, the row's inverse
/// at the state: the value, its covariance and correlations, in place of any that it has.
void Initialise(FilterState& f, const Row& row, const Inverse& inverse);

}  // namespace alidade::internal
