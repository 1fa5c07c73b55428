// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// Reports once for each sensor that an update loses digits of P to rounding (event `digits_lost`).
/// Methods that store P call this function for each measurement of an update, after P was corrected
/// and before x is. Requires H of the measurement. `inverse_d` contains the reciprocals of the
/// pivots of S = L D L' that belong to the measurement.
///
/// The update reduces the variance H P H' of each row of H to at most R. P contains this variance
/// as a sum of terms H_i P_ij H_j, whose rounding error is about eps v, v = sum H_j^2 P_jj. If v is
/// too large compared with R, the variance is lost. Example: the sum of two vague states is
/// measured accurately.
///
/// In a joint update, each pivot is a variance of S minus the part that the preceding rows predict.
/// Its rounding error is about eps S_ii. If S_ii is too large compared with the pivot, the pivot is
/// lost.
void CheckDigits(FilterState& f, const PendingMeasurement& pending, const double* inverse_d);

}  // namespace alidade::internal
