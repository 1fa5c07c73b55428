// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "models.h"

ALIDADE_SOURCE_PLUGIN({"models",
                       "simulator: truth and measurements drawn from the models of the config",
                       alidade::kModelsKeys, &alidade::CreateModels})
