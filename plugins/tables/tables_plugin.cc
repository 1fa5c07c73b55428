// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "tables.h"

ALIDADE_SOURCE_PLUGIN({"tables", "measurements and truth from tables: files or pipes",
                       alidade::kTableKeys, &alidade::CreateTables})
