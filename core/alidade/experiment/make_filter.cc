// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/make_filter.h"

#include "alidade/experiment/build_estimator.h"

namespace alidade {

std::unique_ptr<Filter> MakeFilter(const Config& config, const PluginHost& host,
                                   const std::string& name) {
  const Node entry = config.root().At("estimators", "a filter").At(name, "MakeFilter");
  EstimatorSpec spec = internal::BuildEstimator(name, entry, config, host, nullptr, {});
  const Filter* const filter = spec.estimator->AsFilter();
  if (const auto key = entry.Find("invariant_error")) {
    key->Fail("a filter for live use cannot have an invariant error; remove this key");
  }
  if (filter == nullptr) {
    entry.At("type").Fail("'" + spec.type + "' is not a recursive filter",
                          "ekf, iekf, square_root_ekf or ukf");
  }
  return std::make_unique<Filter>(*filter);
}

}  // namespace alidade
