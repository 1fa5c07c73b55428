// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Computes metrics over the landmarks with a finite position and a known true position:
///
///   map.rmse         sqrt(mean |p - p_true|^2), m
///   map.sim3.rmse    the same for s R p + t, with the similarity that minimises it [Umeyama1991]
///   map.sim3.scale   s; both need at least three landmarks, not all at one position
std::map<std::string, double> MapMetrics(const std::vector<LandmarkEstimate>& landmarks);

/// Adds the final landmarks and their metrics to `result`. Adds the true positions that `source`
/// knows to these landmarks and to those removed earlier. Has no effect if `spec` has no landmarks.
void AddMapMetrics(const EstimatorSpec& spec, const Source& source, EstimatorResult& result);

}  // namespace alidade::internal
