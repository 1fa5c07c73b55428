// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/models.h"
#include "alidade/plugin/model_instance.h"

namespace alidade::internal {

/// Returns an instance with the functions of plugin_abi.h that calls a model of the program. The
/// checks then treat the model like that of a plugin.
std::shared_ptr<const ModelInstance> ExportModel(const SharedSensor& sensor);
/// `step_order` is the order in dt of the error of a step; 0: the step is exactly additive.
std::shared_ptr<const ModelInstance> ExportModel(const SharedMotion& motion, unsigned step_order);

}  // namespace alidade::internal
