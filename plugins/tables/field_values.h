// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/estimation/frame.h"
#include "local_frame.h"
#include "table_layout.h"
#include "table_row.h"

namespace alidade {

/// Returns true if the conditions of the field select the row.
bool IsSelected(const TableRow& row, const TableField& field);

/// Reads the values of a field. Returns false and clears `values` if a value is missing. Errors:
/// kBadData.
bool ReadValues(const TableRow& row, const TableField& field, LocalFrame& frame,
                std::vector<double>& values);

/// Reads the values, the covariance, the landmark and the known numbers of a measurement. Returns
/// false if a value or a known number is missing. A measurement whose covariance is missing has
/// the noise of its sensor. Errors: kBadData.
bool ReadMeasurement(const TableRow& row, const TableField& field, LocalFrame& frame,
                     Measurement& measurement);

}  // namespace alidade
