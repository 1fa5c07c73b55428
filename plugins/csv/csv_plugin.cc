// SPDX-License-Identifier: Apache-2.0
#include "csv.h"

#include "alidade/host/cpp_plugin.h"

ALIDADE_SOURCE_PLUGIN({"csv", "columns of a table, from a file or a pipe", alidade::kCsvKeys,
                       &alidade::CreateCsv})
