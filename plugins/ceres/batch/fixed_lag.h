// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/estimation/estimator_capabilities.h"
#include "alidade/experiment/estimator_plugin.h"

namespace alidade::ceres_batch {

/// No known roles, consider blocks, roles linearised at the measurement.
inline constexpr EstimatorCapabilities kFixedLagCapabilities = {
    .known = false, .from_measurement = true, .landmarks = true};

/// The estimator type `fixed_lag`, from its entry in a config.
EstimatorMaker CreateFixedLag(const EstimatorArguments& arguments);

}  // namespace alidade::ceres_batch
