// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/config_noise.h"

#include <cmath>
#include <limits>
#include <string>

#include "alidade/config/read_covariance.h"

namespace alidade::internal {
namespace {

/// Returns L of A = L L', n x n row-major. Computes L column by column. If a pivot is zero within
/// rounding errors, sets its column to zero and `is_singular` to true.
std::vector<double> RootOf(const std::vector<double>& a, std::size_t n, bool& is_singular) {
  const double rounding = 64.0 * static_cast<double>(n) * std::numeric_limits<double>::epsilon();
  std::vector<double> l(n * n, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    const auto reduced = [&](std::size_t i) {
      double sum = a[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= l[i * n + k] * l[j * n + k];
      return sum;
    };
    const double pivot = reduced(j);
    if (!(pivot > rounding * a[j * n + j])) {
      is_singular = true;
      continue;
    }
    l[j * n + j] = std::sqrt(pivot);
    for (std::size_t i = j + 1; i < n; ++i) l[i * n + j] = reduced(i) / l[j * n + j];
  }
  return l;
}

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

std::vector<double> ReadSqrtR(const Node& covariance, int size) {
  bool is_singular = false;
  std::vector<double> root =
      RootOf(ReadCovariance(covariance, size), static_cast<std::size_t>(size), is_singular);
  if (is_singular) {
    covariance.Fail("is singular, so the measurement would have no noise in one direction",
                    "a positive definite covariance");
  }
  return root;
}

std::vector<double> ReadNoiseRoot(const Node& covariance, const ModelInstance& model) {
  if (model.c().kind == ALIDADE_KIND_SENSOR) {
    return ReadSqrtR(covariance, model.space().geometry.tangent);
  }
  ExpectDiscrete(covariance, model);
  const int n = model.c().description->noise_count;
  bool is_singular = false;
  return RootOf(ReadCovariance(covariance, n), static_cast<std::size_t>(n), is_singular);
}

}  // namespace alidade::internal
