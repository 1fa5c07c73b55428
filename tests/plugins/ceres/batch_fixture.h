// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/experiment/estimator_plugin.h"
#include "plugins/host/host_fixture.h"
#include "support/systems.h"

/// Helpers of the batch tests.
namespace alidade::testing {

/// Returns the plugins of this build.
inline const PluginHost& Shipped() {
  static const PluginHost host;
  return host;
}

/// Creates a batch with these options, one a line.
inline std::unique_ptr<Estimator> MakeBatch(const Problem& problem,
                                            const std::string& options = "") {
  const Config config = Config::FromText("type: ceres_batch\n" + options, "batch.yaml");
  return CreateEstimator(Shipped(), "ceres_batch", config.root())(problem, StreamsOf(problem));
}

/// Creates a fixed-lag smoother with these options, one a line.
inline std::unique_ptr<Estimator> MakeFixedLag(const Problem& problem, const std::string& options) {
  const Config config = Config::FromText("type: fixed_lag\n" + options, "lag.yaml");
  return CreateEstimator(Shipped(), "fixed_lag", config.root())(problem, StreamsOf(problem));
}

/// A point with a linear sensor of 0.3 m; no sensor measures its second block.
inline Problem LinearSystem() {
  Problem problem = MovingPoint(0.7);
  AddSensor(problem, "z", LinearSensor(2.0, 0.3), {"p.x"});
  return problem;
}

}  // namespace alidade::testing
