// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "alidade/experiment/estimator_plugin.h"
#include "plugins/host/host_fixture.h"
#include "support/systems.h"

/// Helpers for the tests of the batch.
namespace alidade::testing {

/// Returns the plugins of this build.
inline const PluginHost& Shipped() {
  static const PluginHost host;
  return host;
}

/// Creates a batch. `options` contains one option per line.
inline std::unique_ptr<Estimator> MakeBatch(const Problem& problem,
                                            const std::string& options = "") {
  const Config config = Config::FromText("type: ceres_batch\n" + options, "batch.yaml");
  return CreateEstimator(Shipped(), "ceres_batch", config.root())(problem, StreamsOf(problem));
}

/// Creates a fixed-lag smoother. `options` contains one option per line.
inline std::unique_ptr<Estimator> MakeFixedLag(const Problem& problem, const std::string& options) {
  const Config config = Config::FromText("type: fixed_lag\n" + options, "lag.yaml");
  return CreateEstimator(Shipped(), "fixed_lag", config.root())(problem, StreamsOf(problem));
}

/// Returns the problem of a moving point. A linear sensor with 0.3 m of noise measures its
/// position; no sensor measures its velocity.
inline Problem LinearSystem() {
  Problem problem = MovingPoint(0.7);
  AddSensor(problem, "z", LinearSensor(2.0, 0.3), {"p.x"});
  return problem;
}

}  // namespace alidade::testing
