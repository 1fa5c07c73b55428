// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "alidade/config/tree.h"

/// Strict readers of numbers: the rules of Node::Number and Node::Integer.
namespace alidade::internal {

/// Returns the number in `tree`. `expected` is the part of an error message after "expected".
double ReadNumber(const ConfigTree& tree, const std::string& expected);
double ReadNumber(const ConfigTree& tree, double low, double high, bool low_open, bool high_open);
std::int64_t ReadInteger(const ConfigTree& tree, std::int64_t low, std::int64_t high);

}  // namespace alidade::internal
