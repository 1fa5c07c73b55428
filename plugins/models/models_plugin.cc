// SPDX-License-Identifier: Apache-2.0
#include "models.h"

#include "alidade/host/cpp_plugin.h"

ALIDADE_SOURCE_PLUGIN({"models",
                       "simulator: truth and measurements drawn from the models of the config",
                       alidade::kModelsKeys, &alidade::CreateModels})
