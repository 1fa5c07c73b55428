// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "support/systems.h"

namespace alidade::testing {
namespace {

TEST(Ekf, ALockedOutSensorOfFixedBlocksInflatesNothing) {
  const auto event_of = [](BlockStatus status) {
    System system = DepthFilter();
    StateLayout layout;
    for (const Block& block : system.layout.blocks()) {
      layout.Declare(block.name, block.owner, block.space,
                     block.name == "target.depth" ? status : block.status);
    }
    system.layout = layout;
    system.priors[0].mean = {3.0};
    system.priors[0].covariance(0, 0) = 1e-6;
    EkfOptions options;
    options.gate = 0.999;
    options.lockout = Lockout::kInflate;
    Ekf ekf(system, options, StreamsOf(system));
    UpdateReport report;
    for (int k = 0; k < 20; ++k) report = ekf.Process(FrameAt(0.0, {{0, 65.0}}));
    return report.events.empty() ? "" : report.events.back().text;
  };
  const std::string why = "sensor 'disparity' rejected 20 times in a row: ";
  EXPECT_EQ(event_of(BlockStatus::kEstimated), why + "inflated the covariance of its blocks");
  EXPECT_EQ(event_of(BlockStatus::kFixed), why + "it corrects no block to inflate");
}

}  // namespace
}  // namespace alidade::testing
