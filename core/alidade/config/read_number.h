// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "alidade/config/tree.h"

/// Numbers of a config, read strictly: as Node::Number and Node::Integer say.
namespace alidade::internal {

/// `expected` is the part of an error message.
double ReadNumber(const ConfigTree& tree, const std::string& expected);
double ReadNumber(const ConfigTree& tree, double low, double high, bool low_open, bool high_open);
std::int64_t ReadInteger(const ConfigTree& tree, std::int64_t low, std::int64_t high);

}  // namespace alidade::internal
