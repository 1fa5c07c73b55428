// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/filter/rows.h"

/// The models at any values x of the whole state: the state itself, an iterate, a sigma point, the
/// hypothesis of a consensus, a point of a batch. What a model does not write is not a number.
namespace alidade::internal {

// Motion models, n_w: noise inputs.

/// Why a step cannot be done; empty where it can.
struct Trouble {
  const char* kind = nullptr;  ///< of the event
  std::string text;
  explicit operator bool() const { return kind != nullptr; }
};

/// x' = f(x, u, w, dt) of one motion model at the values x of the whole state, at the places of its
/// blocks in `next`, and unless null its F (n x n) and G (n x n_w), row-major. w may be null: zero.
Outcome StepAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
               const double* u, const double* w, double dt_s, double* next, double* f, double* g);
/// L of its Qw = L L' there, n_w x n_w, row-major.
Outcome SqrtQAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
                const double* u, double dt_s, double* l);
/// What one of these that is not kAccepted means.
Trouble TroubleOf(const MotionBinding& motion, Outcome outcome);
/// x <- x' of its blocks that are not constant, brought back to their manifolds.
void TakeStep(const MotionBinding& motion, const StateLayout& layout, const double* next,
              double* x);

// Sensor models, m: tangent size of the measurement.

/// The values that fill the roles of a sensor at x; of roles that it knows those of `known`. Null:
/// the role has no place.
void RolesAt(const SensorBinding& sensor, const SensorPlace& place, const std::vector<double>& x,
             const std::vector<double>& known, std::vector<const double*>& roles);

/// h of a measurement at the roles, ambient, and unless null H, m rows of the place's width.
/// `columns` is memory.
Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   std::vector<double*>& columns, std::vector<double>& h,
                   std::vector<double>* jacobian);

/// R at the roles, or as the measurement itself says, m x m. `l` is memory.
Outcome NoiseAt(const SensorModel& model, const Measurement& measurement,
                const double* const* roles, std::vector<double>& l, std::vector<double>& r);

// The same of a row.

/// What fills its roles at x: known roles have the value of `known`. Until the next call.
const double* const* RolesAt(Row& row, const std::vector<double>& x,
                             const std::vector<double>& known);
/// h at x, ambient, in `h`.
Outcome PredictAt(Row& row, const std::vector<double>& x, const std::vector<double>& known,
                  double* h);
/// h at the roles, in the report, and H, in the row.
Outcome LineariseAt(Row& row, const double* const* roles);
/// R at the roles, or as the measurement itself says, in the row.
Outcome NoiseAt(Row& row, const double* const* roles);
/// z (-) h of the h in the report, in the report.
void TakeInnovation(Row& row);
/// H <- H J in the columns of one role, J size x size, row-major.
void ChainJacobian(Row& row, int column, int size, const double* j, Workspace& work);

// Inverse measurement models.

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
Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior,
                 std::vector<const double*>& roles, Inverse& inverse);

}  // namespace alidade::internal
