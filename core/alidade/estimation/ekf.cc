// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ekf.h"

#include <utility>

#include "alidade/estimation/ekf_equations.h"

namespace alidade {

Ekf::Ekf(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(problem), "Ekf", kCapabilities), options, streams,
             std::make_unique<internal::EkfEquations>()) {}

}  // namespace alidade
