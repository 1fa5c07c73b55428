// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/model_instance.h"

namespace alidade::internal {

/// Finds the covariance in the config entry of a model that replaces the model's noise:
/// `covariance` of a sensor, `noise.covariance` of a motion model. `kind` is one of ALIDADE_KIND_*.
std::optional<Node> FindNoiseCovariance(const Node& entry, std::uint32_t kind);

/// Returns the lower triangular matrix L of the covariance L L', n x n row-major. The covariance is
/// R of a sensor, in the tangent space of the measurement, or Qw of a motion model, over its noise
/// inputs. R must be positive definite; Qw may be singular. The noise of a motion model must be
/// discrete, because it must not depend on dt. Errors: kBadConfig.
std::vector<double> ReadNoiseRoot(const Node& covariance, const ModelInstance& model);

}  // namespace alidade::internal
