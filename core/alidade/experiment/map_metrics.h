// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/estimation/landmarks.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// Over the landmarks of a finite place whose true one is known:
///
///   map.rmse         sqrt(mean |p - p_true|^2), m
///   map.sim3.rmse    the same of s R p + t, the similarity that makes it least [Umeyama1991]
///   map.sim3.scale   s; both of three landmarks or more that are not all at one place
std::map<std::string, double> MapMetrics(const std::vector<LandmarkEstimate>& landmarks);

/// The landmarks at the end and their metrics, in `result`; of these and of those removed before
/// the true places that `source` knows. Nothing if `spec` has none.
void NoteMap(const EstimatorSpec& spec, const Source& source, EstimatorResult& result);

}  // namespace alidade::internal
