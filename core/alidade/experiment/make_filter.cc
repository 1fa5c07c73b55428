// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/make_filter.h"

#include "alidade/experiment/build_estimator.h"
#include "alidade/experiment/short_forms.h"

namespace alidade {

std::unique_ptr<Filter> MakeFilter(const Config& config, const PluginHost& host,
                                   const std::string& name) {
  Config expanded = config.Copy();
  ExpandShortForms(expanded, host);
  const Node entry = expanded.root().At("estimators", "a filter").At(name, "MakeFilter");
  EstimatorSpec spec = internal::BuildEstimator(name, entry, expanded, host, nullptr, {});
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
