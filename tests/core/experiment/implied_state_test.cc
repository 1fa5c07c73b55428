// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/implied_state.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/recording.h"
#include "support/systems.h"

namespace alidade::internal {
namespace {

const SensorBinding& SensorOf(const Problem& problem, const std::string& name) {
  for (const SensorBinding& sensor : problem.sensors) {
    if (sensor.name == name) return sensor;
  }
  throw std::out_of_range(name);
}

TEST(ImpliedState, OfASensorThatInitialisesAlone) {
  const Problem problem = testing::DepthFilter();
  const auto depth = ImpliedState::Of(problem, SensorOf(problem, "disparity"), {});
  ASSERT_TRUE(depth);
  EXPECT_FALSE(depth->uses_true_roles());
  EXPECT_EQ(problem.layout[depth->block()].name, "target.depth");
  const double d = 65.0, none = -1.0;  // disparities in px; f B = 26 px m
  EXPECT_DOUBLE_EQ(depth->From({}, &d).value(), 0.4);
  EXPECT_FALSE(depth->From({}, &none));
}

TEST(ImpliedState, OfAnotherWithItsRestAtTruth) {
  const Problem problem = testing::DepthFilter();
  const SensorBinding& scale = SensorOf(problem, "inverse_scale");
  const auto depth = ImpliedState::Of(problem, scale, {{"depth", 1}, {"inverse_distance", 1}});
  ASSERT_TRUE(depth);
  EXPECT_TRUE(depth->uses_true_roles());
  const double z = 1.25;  // z = lambda Z
  EXPECT_NEAR(depth->From({{0.3}, {2.5}}, &z).value(), 0.5, 1e-12);
  EXPECT_FALSE(depth->From({{0.3}, {}}, &z)) << "lambda is not known at this time";
  EXPECT_FALSE(ImpliedState::Of(problem, scale, {{"depth", 1}}))
      << "the truth does not contain lambda at any time";
}

TEST(ImpliedStateMetrics, AreTheErrorOfSingleMeasurements) {
  Experiment experiment = testing::MakeExperiment(), again = testing::MakeExperiment();
  const RunResult result = alidade::Run(experiment, {});
  double sum = 0.0;
  int count = 0;
  for (SourceFrame frame; again.source->Next(frame);) {
    for (const Measurement& m : frame.measurements) {
      if (m.stream != 0 || frame.truth[0].empty()) continue;
      sum += std::pow(26.0 / m.values[0] - frame.truth[0][0], 2);
      ++count;
    }
  }
  ASSERT_EQ(count, 30);
  for (const EstimatorResult& one : result.estimators) {
    EXPECT_NEAR(one.metrics.at("implied.rmse:disparity"), std::sqrt(sum / count), 1e-12);
    EXPECT_EQ(one.units.at("disparity"), "m");
    EXPECT_FALSE(one.metrics.contains("implied.rmse:inverse_scale")) << "lambda has no truth";
  }
}

}  // namespace
}  // namespace alidade::internal
