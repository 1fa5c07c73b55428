// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/filter/filter_state.h"

/// Sensor models at any values x of the whole state: the state itself, an iterate, a sigma point,
/// the hypothesis of a consensus, a point of a batch. m: tangent size of the measurement.
namespace alidade::internal {

/// The values that fill the roles of a sensor at x; of roles that it knows those of `known`. Null:
/// the role has no place.
void RolesAt(const SensorBinding& sensor, const SensorPlace& place, const std::vector<double>& x,
             const std::vector<double>& known, std::vector<const double*>& roles);

/// h at the roles, ambient, and unless null H, m rows of the place's width. What the model does not
/// write is not a number. `columns` is memory.
Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place, const double* const* roles,
                   std::vector<double*>& columns, std::vector<double>& h,
                   std::vector<double>* jacobian);

/// R at the roles, or as the measurement itself says, m x m. `l` is memory.
Outcome NoiseAt(const SensorModel& model, const Measurement& measurement,
                const double* const* roles, std::vector<double>& l, std::vector<double>& r);

/// What a measurement tells of the roles that its sensor initialises: y = g(other roles, z, prior),
/// t: its tangent. One that is used again for the same sensor keeps its memory.
struct Inverse {
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
Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place, const double* z,
                 const double* prior, std::vector<const double*>& roles, Inverse& inverse);

// Of a row of a filter:

/// What fills its roles at x: known roles have the value that the state has. Until the next call.
const double* const* RolesAt(FilterState& f, const Row& row, const std::vector<double>& x);

/// h at x, ambient, in `h`.
Outcome PredictAt(FilterState& f, const Row& row, const std::vector<double>& x, double* h);

/// h at the roles, in the report, and H, in the row.
Outcome LineariseAt(FilterState& f, Row& row, const double* const* roles);

/// R at the roles, or as the measurement itself says, in the row.
inline Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.measurement, roles, row.L, row.R);
}

/// z (-) h of the h in the report, in the report.
void TakeInnovation(Row& row);

/// H <- H J in the columns of one role, J size x size, row-major.
void ChainJacobian(FilterState& f, Row& row, int column, int size, const double* j);

/// The inverse of its measurement at the state. `prior` may be null where the model needs none.
/// kAccepted, or why not.
Outcome Invert(FilterState& f, Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse);

}  // namespace alidade::internal
