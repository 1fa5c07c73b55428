// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/filter_options.h"
#include "alidade/filter/ukf.h"

namespace alidade {
namespace {

UkfOptions Read(Params& p) {
  UkfOptions options;
  options.alpha = p.Number("alpha", "", "spread of the sigma points",
                           {UkfOptions::kLeastAlpha, 1.0, false, false}, options.alpha);
  options.beta = p.NonNegative("beta", "", "weight of what the centre adds; 2: best for a Gaussian",
                               options.beta);
  options.kappa =
      p.NonNegative("kappa", "", "spread beyond the number of directions", options.kappa);
  options.filter = internal::ReadCommonOptions(p);
  return options;
}

}  // namespace

UkfOptions UkfOptions::FromNode(const Node& entry) {
  return internal::OptionsFromNode(entry, "ukf", Read);
}

std::vector<ParamInfo> UkfOptions::Schema() { return internal::SchemaOf(Read); }

}  // namespace alidade
