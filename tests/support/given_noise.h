// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "alidade/model/plugin.h"
#include "alidade/plugin/plugin_models.h"

/// Models in this process whose noise is replaced by a given noise. For tests.
namespace alidade::testing {

/// Returns the sensor with noise L = `root`, m x m row-major: R = L L'.
template <class Model>
SharedSensor SensorOfNoise(Model model, std::vector<double> root) {
  AlidadeInstance instance{};
  instance.struct_size = sizeof(instance);
  detail::PublishSensor(std::make_unique<detail::Holder<Model>>(std::move(model)), &instance);
  const auto made = std::make_shared<ModelInstance>(instance, "of given noise", "in process");
  made->SetNoise(std::move(root));
  return std::make_shared<PluginSensor>(made);
}

/// Returns the motion model with noise L = `root`, n_w x n_w row-major: Qw = L L'.
template <class Model>
SharedMotion MotionOfNoise(Model model, std::vector<double> root) {
  AlidadeInstance instance{};
  instance.struct_size = sizeof(instance);
  detail::PublishMotion(std::make_unique<detail::Holder<Model>>(std::move(model)), &instance);
  const auto made = std::make_shared<ModelInstance>(instance, "of given noise", "in process");
  made->SetNoise(std::move(root));
  return std::make_shared<PluginMotion>(made);
}

}  // namespace alidade::testing
