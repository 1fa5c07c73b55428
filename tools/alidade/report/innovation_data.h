// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/report/run_tables.h"

namespace alidade::internal {

/// Returns the list of the innovations of each sensor of an estimator, for the data of a page.
Json InnovationData(const EstimatorTables& tables, const RunTimes& times, ColumnPool& pool);
/// Returns the list of the gains of each sensor.
Json GainData(const EstimatorTables& tables, const RunTimes& times, ColumnPool& pool);

}  // namespace alidade::internal
