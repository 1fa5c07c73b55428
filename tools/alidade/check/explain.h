// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/experiment/run.h"

namespace alidade {

/// What `experiment`, made from `config`, does, for a person to read before running it: for each
/// estimator its blocks and how they start, what moves and measures them, which directions of the
/// state no sensor determines, its options, and what it supports.
std::string Explain(const Config& config, const Experiment& experiment);

}  // namespace alidade
