// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "support/recording.h"

namespace alidade::testing {
namespace {

TEST(CeresBatch, KeysOfFiltersAreRefusedByName) {
  for (const auto& [key, what] : {std::pair{"gate: 0.99", "gate"},
                                  {"fuse: joint", "choice of updates"},
                                  {"jacobian: latest", "choice of Jacobian"},
                                  {"lockout: {action: none}", "recovery from a lock-out"}}) {
    const Config config = Config::FromText(R"(alidade: 1
state:
  p: {model: constant, blocks: {value: x}, initial: {x: {mean: 0, sigma: 1}}}
sensors:
  s: {model: scale_2d, stream: inverse_scale, roles: {depth: p.x, inverse_distance: p.x},
      template_px: 300, sigma_px: 1.0}
source: {type: depth_target, seed: 1}
estimators:
  batch: {type: ceres_batch, )" + std::string(key) +
                                               "}\n",
                                           "batch.yaml");
    std::string text;
    EXPECT_EQ(CodeOf([&] { BuildExperiment(config, Host()); }, &text), 78);
    EXPECT_NE(text.find(std::string("estimator type 'ceres_batch' has no ") + what),
              std::string::npos)
        << text;
  }
}

}  // namespace
}  // namespace alidade::testing
