// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/filter/evaluate_models.h"
#include "alidade/filter/filter_state.h"

/// The sensor model of a row of a filter, at any values x of the whole state.
namespace alidade::internal {

/// What fills its roles at x: known roles have the value that the state has. Until the next call.
const double* const* RolesAt(FilterState& f, const Row& row, const std::vector<double>& x);

/// h at x, ambient, in `h`.
Outcome PredictAt(FilterState& f, const Row& row, const std::vector<double>& x, double* h);

/// h at the roles, in the report, and H, in the row.
Outcome LineariseAt(FilterState& f, Row& row, const double* const* roles);

/// R at the roles, or as the measurement itself says, in the row.
Outcome NoiseAt(Row& row, const double* const* roles);

/// z (-) h of the h in the report, in the report.
void TakeInnovation(Row& row);

/// H <- H J in the columns of one role, J size x size, row-major.
void ChainJacobian(FilterState& f, Row& row, int column, int size, const double* j);

/// The inverse of its measurement at the state. `prior` may be null where the model needs none.
/// kAccepted, or why not.
Outcome Invert(FilterState& f, Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse);

}  // namespace alidade::internal
