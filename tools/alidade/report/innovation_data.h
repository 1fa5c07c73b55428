// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/report/run_tables.h"

namespace alidade::internal {

/// Returns the list of the innovations of each sensor of an estimator, for the data of a page. If
/// `has_measurements` is true, the list also contains measurements and their predictions.
Json InnovationData(const EstimatorTables& tables, bool has_measurements, const RunTimes& times,
                    ColumnPool& pool);
/// Returns the list of the gains of each sensor, with at most 5000 rows for each sensor. Omits a
/// sensor with more than 24 gains.
Json GainData(const EstimatorTables& tables, const RunTimes& times, ColumnPool& pool);

}  // namespace alidade::internal
