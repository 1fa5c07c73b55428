// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace alidade::internal {

/// Names of the models whose equations are in their config entries: as expressions, and as
/// matrices. These models are part of the program.
inline constexpr const char* kFormula = "formula";
inline constexpr const char* kLinear = "linear";

/// Sensor model and motion model that is part of the program.
struct BuiltInModel {
  const char* name;
  const char* doc;
};
inline constexpr BuiltInModel kBuiltInModels[] = {
    {kFormula, "the expressions of its entry in the config (docs/formula.md)"},
    {kLinear, "the matrices of its entry in the config (docs/formula.md)"}};

/// Returns whether the equations of a model are in its config entry.
inline bool HasEquationsInConfig(std::string_view model) {
  return model == kFormula || model == kLinear;
}

}  // namespace alidade::internal
