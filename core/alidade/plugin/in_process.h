// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include "alidade/model/plugin.h"
#include "alidade/plugin/model_instance.h"

/// Models used directly from C++, without a plugin file: the same thunks, in this process.
namespace alidade {

/// The sensor `model`; `name` is for messages.
template <class Model>
SensorModel InProcessSensor(Model model, const char* name) {
  AlidadeInstance instance{};
  instance.struct_size = sizeof(instance);
  detail::PublishSensor(std::make_unique<detail::Holder<Model>>(std::move(model)), &instance);
  return SensorModel(std::make_shared<ModelInstance>(instance, name, "in process"));
}

/// The motion model `model`; `name` is for messages.
template <class Model>
MotionModel InProcessMotion(Model model, const char* name) {
  AlidadeInstance instance{};
  instance.struct_size = sizeof(instance);
  detail::PublishMotion(std::make_unique<detail::Holder<Model>>(std::move(model)), &instance);
  return MotionModel(std::make_shared<ModelInstance>(instance, name, "in process"));
}

}  // namespace alidade
