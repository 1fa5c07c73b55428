// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Adds a time offset to a sensor whose clock is wrong by delta: a measurement with the timestamp t
/// was made at t + delta. The new sensor model is
///
///   z = h(x(t + delta)),   x(t + delta) = f(x(t), u = 0, w = 0, delta)
///   dz/dx = H F(delta),    dz/ddelta = H df/ddelta
///
/// delta, in s, is the block `offset` of the problem. f denotes the motion models that change
/// blocks of the sensor. The roles of the new sensor are, in this order: all blocks of these motion
/// models, the roles that do not move, delta, and the roles of a landmark. Process noise during
/// delta is neglected. Therefore delta must be so short that the process noise over delta is
/// negligible. The new sensor does not have an inverse measurement model for a role that moves.
/// df/ddelta is computed by central differences of fourth order with steps of 1 ms.
///
/// Returns "", or the reason why an offset is not possible: a role has `jacobian_at: measurement`,
/// a motion model has a control input, or no motion model changes a block of the sensor. Source:
/// [Li2014], which also defines the sign of delta.
std::string OffsetInTime(const Problem& problem, BlockId offset, SensorBinding& sensor);

}  // namespace alidade::internal
