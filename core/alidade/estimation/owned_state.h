// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/models.h"

namespace alidade::internal {

/// The motion of a state that its sensor owns, one block x of the geometry, mu its prior mean:
///
///   constant      x' = x
///   random walk   x' = x (+) w,                            w ~ N(0, L L' dt)
///   Gauss-Markov  x' = mu (+) a (x (-) mu) (+) w,          w ~ N(0, L L' tau (1 - a^2) / 2),
///                                                          a = exp(-dt / tau)
///
/// The model is named `constant`, `random_walk` or `gauss_markov`. L is the density of the driving
/// white noise, tau the time constant. Noise is continuous; exact for vectors and angles.
/// [BarShalom2001] ch. 4.
SharedMotion OwnedMotion(const Geometry& geometry, const OwnedRole& owned);

}  // namespace alidade::internal
