// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/model_instance.h"

namespace alidade::internal {

/// Returns the covariance that replaces the model's own noise, or nullopt if the config entry of
/// the model does not contain one. The key is `covariance` for a sensor and `noise.covariance` for
/// a motion model. `kind` is one of ALIDADE_KIND_*.
std::optional<Node> FindNoiseCovariance(const Node& entry, std::uint32_t kind);

/// Returns the lower triangular matrix L of the covariance L L', n x n row-major. For a sensor, the
/// covariance is R in the tangent space of the measurement, and must be positive definite. For a
/// motion model, the covariance is Qw of the noise inputs, and may be singular. The noise of the
/// motion model must be discrete, because Qw must not depend on dt. Error: kBadConfig.
std::vector<double> ReadNoiseRoot(const Node& covariance, const ModelInstance& model);

}  // namespace alidade::internal
