// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/models.h"

namespace alidade::internal {

/// Returns the motion model of a model parameter state. The state is one block x with the given
/// geometry. mu is the mean of its prior.
///
///   constant      x' = x
///   random walk   x' = x (+) w,                            w ~ N(0, L L' dt)
///   Gauss-Markov  x' = mu (+) a (x (-) mu) (+) w,          w ~ N(0, L L' tau (1 - a^2) / 2),
///                                                          a = exp(-dt / tau)
///
/// The name of the model is `constant`, `random_walk` or `gauss_markov`. L L' is the spectral
/// density of the continuous white noise that drives the process. tau is the time constant. The
/// discretisation is exact for vectors and angles. Source: [BarShalom2001] ch. 4.
SharedMotion OwnedMotion(const Geometry& geometry, const OwnedRole& owned);

}  // namespace alidade::internal
