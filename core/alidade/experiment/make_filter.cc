// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/make_filter.h"

#include <utility>

#include "alidade/experiment/build_estimator.h"

namespace alidade {

std::unique_ptr<Filter> MakeFilter(const Config& config, const PluginHost& host,
                                   const std::string& name) {
  const Node entry = config.root().At("estimators", "a filter").At(name, "MakeFilter");
  EstimatorSpec spec = internal::BuildEstimator(name, entry, config, host, nullptr, {});
  auto* const filter = dynamic_cast<Filter*>(spec.estimator.get());
  if (filter == nullptr) {
    entry.At("type").Fail("'" + spec.type + "' is not a recursive filter",
                          "ekf, iekf, square_root_ekf or ukf");
  }
  return std::make_unique<Filter>(std::move(*filter));
}

}  // namespace alidade
