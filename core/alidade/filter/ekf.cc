// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/ekf.h"

#include "alidade/filter/linear.h"

namespace alidade {

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(std::move(system), options, streams, std::make_unique<internal::Linear>()) {}

}  // namespace alidade
