// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ekf.h"

#include <utility>

#include "alidade/estimation/linear.h"

namespace alidade {

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(system), "Ekf", kSupport), options, streams,
             std::make_unique<internal::Linear>()) {}

}  // namespace alidade
