// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/config_noise.h"

#include <string>

#include "alidade/config/read_covariance.h"

namespace alidade::internal {
namespace {

void ExpectDiscrete(const Node& covariance, const ModelInstance& model) {
  if ((model.capabilities() & ALIDADE_DISCRETE_NOISE) == 0) {
    covariance.Fail(
        "model '" + model.name() + "' has continuous noise, whose covariance depends on dt",
        "the noise keys of the model, or `noise.kind: discrete` if the model offers it");
  }
  if (model.c().description->noise_count == 0) {
    covariance.Fail("model '" + model.name() + "' has no noise inputs; remove this key");
  }
}

}  // namespace

std::optional<Node> FindNoiseCovariance(const Node& entry, std::uint32_t kind) {
  if (!entry.is_map()) return std::nullopt;
  if (kind == ALIDADE_KIND_SENSOR) return entry.Find("covariance");
  const std::optional<Node> noise = entry.Find("noise");
  return noise && noise->is_map() ? noise->Find("covariance") : std::nullopt;
}

std::vector<double> ReadNoiseRoot(const Node& covariance, const ModelInstance& model) {
  if (model.c().kind == ALIDADE_KIND_SENSOR) {
    return ReadSqrtR(covariance, model.space().geometry.tangent);
  }
  ExpectDiscrete(covariance, model);
  const int n = model.c().description->noise_count;
  return ReadSqrtCovariance(covariance, n);
}

}  // namespace alidade::internal
