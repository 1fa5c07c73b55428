// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Computes metrics of the landmarks whose position is finite and whose true position is known:
///
///   map.rmse         sqrt(mean |p - p_true|^2), m
///   map.sim3.rmse    minimum of sqrt(mean |s R p + t - p_true|^2) over s, R, t [Umeyama1991], m
///   map.sim3.scale   s at this minimum
///
/// The metrics `map.sim3` need at least three landmarks that are not all at one position.
std::map<std::string, double> MapMetrics(const std::vector<LandmarkEstimate>& landmarks);

/// Adds the final landmarks and their metrics to `result`. Also adds the known true positions of
/// these landmarks, and of the landmarks that were removed earlier. Has no effect if `spec` has no
/// landmarks.
void AddMapMetrics(const EstimatorSpec& spec, const Source& source, EstimatorResult& result);

}  // namespace alidade::internal
