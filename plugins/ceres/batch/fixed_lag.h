// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/host/cpp_plugin.h"

namespace alidade::ceres_batch {

/// The estimator type `fixed_lag`, from its entry in a config.
EstimatorMaker CreateFixedLag(const EstimatorArguments& arguments);

}  // namespace alidade::ceres_batch
