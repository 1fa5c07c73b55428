// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/plugin/model_instance.h"

namespace alidade::internal {

/// The covariance that the config entry of a model of `kind` (ALIDADE_KIND_*) gives in place of the
/// model's noise: `covariance` of a sensor, `noise.covariance` of a motion model.
std::optional<Node> GivenCovariance(const Node& entry, std::uint32_t kind);

/// L of the covariance L L', n x n row-major and lower triangular: of R of a sensor, in the tangent
/// of its measurement, or of Qw of a motion model, in its noise inputs. R has to be definite; Qw
/// may be singular, and its noise discrete, which does not depend on dt. Errors: kBadConfig.
std::vector<double> RootForModel(const Node& covariance, const ModelInstance& model);

}  // namespace alidade::internal
