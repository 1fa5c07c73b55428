// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/experiment/estimator_plugin.h"
#include "plugins/host/host_fixture.h"
#include "support/systems.h"

/// What the tests of the batch share.
namespace alidade::testing {

/// The plugins of this build.
inline const PluginHost& Shipped() {
  static const PluginHost host;
  return host;
}

/// A batch with these options, one a line.
inline std::unique_ptr<Estimator> MakeBatch(const Problem& problem,
                                            const std::string& options = "") {
  const Config config = Config::FromText("type: ceres_batch\n" + options, "batch.yaml");
  return CreateEstimator(Shipped(), "ceres_batch", config.root())(problem, StreamsOf(problem));
}

/// A fixed-lag smoother likewise.
inline std::unique_ptr<Estimator> MakeFixedLag(const Problem& problem, const std::string& options) {
  const Config config = Config::FromText("type: fixed_lag\n" + options, "lag.yaml");
  return CreateEstimator(Shipped(), "fixed_lag", config.root())(problem, StreamsOf(problem));
}

/// A point with a linear sensor of 0.3 m; its second block is measured by none.
inline Problem LinearSystem() {
  Problem problem = MovingPoint(0.7);
  AddSensor(problem, "z", LinearSensor(2.0, 0.3), {"p.x"});
  return problem;
}

}  // namespace alidade::testing
