// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

/// Short names of the values of a varied key, for the axis or key of a figure. Of long values, as
/// of maps, they have what differs between them alone.
std::vector<std::string> ValueLabels(const std::vector<std::string>& values);

}  // namespace alidade::internal
