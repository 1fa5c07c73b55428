// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace alidade::internal {

/// Names of the models whose equations are in their config entries: as expressions, and as
/// matrices. These models are part of the program.
inline constexpr const char* kFormula = "formula";
inline constexpr const char* kLinear = "linear";

/// Returns whether the equations of a model are in its config entry.
inline bool HasEquationsInConfig(std::string_view model) {
  return model == kFormula || model == kLinear;
}

}  // namespace alidade::internal
