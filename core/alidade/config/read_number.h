// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "alidade/config/tree.h"

/// Strict readers of numbers, which implement Node::Number and Node::Integer.
namespace alidade::internal {

/// Returns the number in `tree`. `expected` is the text after "expected" in an error message.
double ReadNumber(const ConfigTree& tree, const std::string& expected);
double ReadNumber(const ConfigTree& tree, double low, double high, bool low_open, bool high_open);
std::int64_t ReadInteger(const ConfigTree& tree, std::int64_t low, std::int64_t high);

}  // namespace alidade::internal
