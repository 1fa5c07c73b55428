// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/source_plugin.h"
#include "csv.h"

ALIDADE_SOURCE_PLUGIN({"csv", "measurements and truth from a table: a file or a pipe",
                       alidade::kCsvKeys, &alidade::CreateCsv})
