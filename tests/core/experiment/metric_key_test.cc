// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/metric_key.h"

#include <gtest/gtest.h>

#include "alidade/experiment/metric_table.h"

namespace alidade {
namespace {

TEST(MetricKey, IsItsTextAndBack) {
  for (const char* text : {"rmse:target.depth@blind", "nees.mean:target", "map.sim3.rmse",
                           "accepted:stereo", "coverage95:a.b@far"}) {
    EXPECT_EQ(MetricKey::Parse(text).text(), text);
  }
  const MetricKey key = MetricKey::Parse("rmse:target.depth@blind");
  EXPECT_EQ(key.name, "rmse");
  EXPECT_EQ(key.subject, "target.depth");
  EXPECT_EQ(key.segment, "blind");
  EXPECT_EQ(MetricKey::Parse("map.rmse").subject, "");
}

TEST(MetricTable, HasAtMostOneSampleFunctionWhichFitsTheSubject) {
  for (const MetricInfo& metric : kMetrics) {
    const bool is_of_block = metric.block != nullptr, is_of_owner = metric.owner != nullptr;
    const bool is_of_sensor = metric.sensor != nullptr, is_implied = metric.implied != nullptr;
    EXPECT_LE(is_of_block + is_of_owner + is_of_sensor + is_implied, 1) << metric.name;
    if (is_of_block) {
      EXPECT_EQ(metric.subject, MetricSubject::kBlock) << metric.name;
    }
    if (is_of_owner) {
      EXPECT_EQ(metric.subject, MetricSubject::kOwner) << metric.name;
    }
    if (is_of_sensor || is_implied) {
      EXPECT_EQ(metric.subject, MetricSubject::kSensor) << metric.name;
    }
  }
}

TEST(MetricTable, HasEachNameOnceAndAPriorityOnce) {
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    EXPECT_EQ(FindMetric(kMetrics[i].name), &kMetrics[i]) << kMetrics[i].name;
    for (std::size_t k = 0; k < i && kMetrics[i].priority > 0; ++k) {
      EXPECT_NE(kMetrics[k].priority, kMetrics[i].priority) << kMetrics[i].name;
    }
  }
  EXPECT_EQ(FindMetric("rms"), nullptr);
}

}  // namespace
}  // namespace alidade
