// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Adds a time offset to a sensor whose clock is off by delta: its measurement with the timestamp t
/// was made at t + delta,
///
///   z = h(x(t + delta)),   x(t + delta) = f(x(t), u = 0, w = 0, delta)
///   dz/dx = H F(delta),    dz/ddelta = H df/ddelta
///
/// with delta, s, the block `offset` of the problem, and f the motion models that move its roles.
/// The roles of the new sensor are all their blocks, then delta, then the roles of a landmark.
/// Process noise during delta is neglected, so that delta has to be short compared with the time
/// over which the noise matters. The new sensor has no inverse measurement model of a role that
/// moves. df/ddelta is computed by central differences of fourth order in dt, 1 ms apart.
///
/// Returns "", or the reason why it is not possible: a role with `jacobian_at: measurement`, a
/// motion model with a control input, or no motion model that moves a role.
/// Source: [Li2014], also for the sign.
std::string OffsetInTime(const Problem& problem, BlockId offset, SensorBinding& sensor);

}  // namespace alidade::internal
