// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

/// Returns short labels of the values of a varied key. If a value is long, each label contains only
/// the entries of its list or map that other values do not have.
std::vector<std::string> ValueLabels(const std::vector<std::string>& values);

}  // namespace alidade::internal
