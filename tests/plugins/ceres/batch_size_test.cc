// SPDX-License-Identifier: Apache-2.0
#include "batch_fixture.h"

namespace alidade {
namespace {

// The prior has two inputs, and each step has one. The 1001st input belongs to the thousandth
// frame, at 49.95 s.
TEST(CeresBatchSize, WhatTakesLongIsSaidOnce) {
  const auto batch = testing::MakeBatch(testing::LinearSystem(), "solver: dense\n");
  std::vector<Event> events;
  for (int k = 0; k < 1100; ++k) {
    const UpdateReport& report = batch->Process(testing::FrameAt(0.05 * k, {{0, 2.0}}));
    events.insert(events.end(), report.events.begin(), report.events.end());
  }
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::kSlow);
  EXPECT_EQ(events[0].timestamp, TimestampFromSeconds(49.95));
  EXPECT_EQ(events[0].text,
            "more than 1000 noise inputs: the time of a solve grows with their cube");
}

}  // namespace
}  // namespace alidade
