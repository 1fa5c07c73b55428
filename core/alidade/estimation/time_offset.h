// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/problem.h"

namespace alidade::internal {

/// Makes a sensor one whose clock is off: what it measures at the timestamp t it saw at t + delta,
///
///   z = h(x(t + delta)),   x(t + delta) = f(x(t), u = 0, w = 0, delta)
///   dz/dx = H F(delta),    dz/ddelta = H df/ddelta
///
/// with delta, s, the block `offset` of the problem, and f the motion models that move its roles.
/// All their blocks become roles of the sensor, then delta, then those of a landmark. Process noise
/// over delta is left out, which has to be short compared with the time over which it matters. An
/// inverse measurement model of a role that moves is lost. df/ddelta is by central differences over
/// dt of fourth order, 1 ms apart.
///
/// Error: what cannot be done, in words; "" where it is done. A motion model with a control input
/// moves a role.
/// Source: [Li2014], for the sign as well.
std::string OffsetInTime(const Problem& problem, BlockId offset, SensorBinding& sensor);

}  // namespace alidade::internal
