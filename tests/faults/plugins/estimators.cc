// SPDX-License-Identifier: Apache-2.0
// A C++ plugin with two faulty estimators. One of them throws while its options are read. The other
// returns an empty function for creating the estimator.
#include <stdexcept>

#include "alidade/experiment/estimator_plugin.h"

namespace {

alidade::EstimatorMaker Throw(const alidade::EstimatorArguments& arguments) {
  static_cast<void>(arguments.params.Positive("gain", "", "required"));
  throw std::runtime_error("no such thing");
}

alidade::EstimatorMaker MakeNothing(const alidade::EstimatorArguments&) { return {}; }

}  // namespace

ALIDADE_ESTIMATOR_PLUGIN({"throwing_estimator", "throws", "", &Throw},
                         {"no_estimator", "makes nothing", "", &MakeNothing})
