// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::internal {

/// Name of the models whose equations are expressions in their config entries. These models are
/// part of the program.
inline constexpr const char* kFormula = "formula";

}  // namespace alidade::internal
