// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/report/run_tables.h"

namespace alidade::internal {

/// Returns the object of an estimator in the data of a page. `columns` are the contents of
/// columns.json. `gate` is the probability of the gate, or null. If `has_measurements` is true, the
/// object also contains measurements and their predictions. docs/report.md describes the object.
Json EstimatorData(const EstimatorTables& tables, const Json& columns, const Json& gate,
                   bool has_measurements, const RunTimes& times, ColumnPool& pool);

}  // namespace alidade::internal
