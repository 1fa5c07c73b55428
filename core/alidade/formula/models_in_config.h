// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/estimation/models.h"
#include "alidade/plugin/built_in_models.h"

/// Models whose equations are in their config entries; docs/formula.md describes the keys. These
/// models are part of the program.
namespace alidade::internal {

/// Create a motion model from its config entry. Error: kBadConfig.
SharedMotion CreateFormulaMotion(const Node& entry);
SharedMotion CreateLinearMotion(const Node& entry);

/// Create a sensor model from its config entry. `bound_roles` are the blocks that the key `roles`
/// binds, with the names of the roles. The key `owns` adds roles. `has_landmark`, or the key
/// `landmark`, adds the role `landmark`. Error: kBadConfig.
SharedSensor CreateFormulaSensor(const Node& entry, const std::vector<Space>& bound_roles,
                                 bool has_landmark);
SharedSensor CreateLinearSensor(const Node& entry, const std::vector<Space>& bound_roles,
                                bool has_landmark);

struct ModelInConfig {
  const char* name;
  SharedMotion (*create_motion)(const Node& entry);
  SharedSensor (*create_sensor)(const Node& entry, const std::vector<Space>& bound_roles,
                                bool has_landmark);
};

inline constexpr ModelInConfig kModelsInConfig[] = {
    {kFormula, CreateFormulaMotion, CreateFormulaSensor},
    {kLinear, CreateLinearMotion, CreateLinearSensor},
};

/// Returns the model of this name, or null for the model of a plugin.
constexpr const ModelInConfig* FindModelInConfig(std::string_view name) {
  for (const ModelInConfig& model : kModelsInConfig) {
    if (name == model.name) return &model;
  }
  return nullptr;
}

}  // namespace alidade::internal
