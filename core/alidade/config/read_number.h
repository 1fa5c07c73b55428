// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "alidade/config/tree.h"

/// Strict readers of numbers, which implement Node::Number and Node::Integer.
namespace alidade::internal {

/// Returns the number in `tree`. `expected` is the text after "expected" in an error message. The
/// message also contains `unit`.
double ReadNumber(const ConfigTree& tree, const std::string& expected, std::string_view unit = {});
double ReadNumber(const ConfigTree& tree, double low, double high, bool low_open, bool high_open,
                  std::string_view unit = {});
std::int64_t ReadInteger(const ConfigTree& tree, std::int64_t low, std::int64_t high);

}  // namespace alidade::internal
