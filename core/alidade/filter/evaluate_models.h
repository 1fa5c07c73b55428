// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/filter/filter_state.h"

/// Sensor models at any values x of the whole state: the state itself, an iterate, a sigma point,
/// the hypothesis of a consensus.
namespace alidade::internal {

/// What fills the roles of a row at x: known roles have the value that the state has. Until the
/// next call.
const double* const* RolesAt(FilterState& f, const Row& row, const std::vector<double>& x);

/// h at x, ambient, in `h`.
Outcome PredictAt(FilterState& f, const Row& row, const std::vector<double>& x, double* h);

/// h at the roles, in the report, and H, in the row; of H what the model does not write is not a
/// number.
Outcome LineariseAt(FilterState& f, Row& row, const double* const* roles);

/// R at the roles, or as the measurement itself says, in the row.
Outcome NoiseAt(Row& row, const double* const* roles);

/// z (-) h of the h in the report, in the report.
void TakeInnovation(Row& row);

/// H <- H J in the columns of one role, J size x size, row-major.
void ChainJacobian(FilterState& f, Row& row, int column, int size, const double* j);

/// What a measurement tells of the roles that its sensor initialises: y = g(other roles, z, prior).
struct Inverse {
  std::vector<double> y;               ///< values, one role after the other
  std::vector<BlockId> from;           ///< the blocks that it took
  std::vector<double> jacobian;        ///< dy/d from, their columns side by side, row-major
  std::vector<double> own;             ///< J_z R J_z' + J_p sigma^2 J_p', p the prior; row-major
  Eigen::Index rows = 0, columns = 0;  ///< of the Jacobian
};
/// The inverse of a row's measurement at the state. `prior` may be null where the model needs none.
/// kAccepted, or why not.
Outcome Invert(FilterState& f, Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse);

}  // namespace alidade::internal
