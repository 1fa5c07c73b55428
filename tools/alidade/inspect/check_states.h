// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alidade/inspect/model_under_test.h"

namespace alidade::internal {

/// `count` random values of the slots of a model, then states at the edges: each slot in turn zero,
/// tiny, large or where its geometry wraps, turns over or is counted twice, the others random. The
/// slot of a sensor's measurement is random here; half of the random states leave optional roles
/// unbound.
std::vector<Values> RandomStates(const Model& model, int count, std::uint64_t seed);

}  // namespace alidade::internal
