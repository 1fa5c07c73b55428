// SPDX-License-Identifier: Apache-2.0
//
// Tests the keys (legends) of the figures that gnuplot draws.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "support/recording.h"
#include "support/systems.h"

namespace alidade::testing {
namespace {

constexpr double kWidth = 960.0;

/// Returns the x positions of the texts in an svg file, in pixels, for each text.
std::map<std::string, std::vector<double>> TextsOf(const std::string& svg) {
  std::map<std::string, std::vector<double>> texts;
  const std::string open = "<text>", place = "translate(";
  for (std::size_t at = svg.find(open); at != svg.npos; at = svg.find(open, at + 1)) {
    const std::size_t start = at + open.size();
    const double x = std::atof(svg.c_str() + svg.rfind(place, at) + place.size());
    texts[svg.substr(start, svg.find('<', start) - start)].push_back(x);
  }
  return texts;
}

class FigureKey : public ::testing::TestWithParam<int> {};

// In the comparison figure each panel has a key that lists all estimators in one column.
TEST_P(FigureKey, HasAllEstimatorsInOneColumn) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  experiment.estimators.clear();
  for (int i = 0; i < GetParam(); ++i) {
    EstimatorSpec named;
    named.name = "an_estimator_" + std::to_string(i);
    named.problem = DepthFilter();
    named.estimator =
        std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
    experiment.estimators.push_back(std::move(named));
  }
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  if (recorder.note().ends_with("not installed")) GTEST_SKIP() << recorder.note();
  auto texts = TextsOf(Read(folder / "out/figures/comparison.svg"));
  const double column = texts["truth"].empty() ? 0.0 : texts["truth"][0];
  for (int i = 0; i < GetParam(); ++i) {
    const std::string name = "an_estimator_" + std::to_string(i);
    // Each name occurs in the panels of the depth, its rate and the inverse distance.
    ASSERT_EQ(texts[name].size(), 3u) << name;
    for (const double x : texts[name]) {
      EXPECT_NEAR(x, column, 1.0) << name;
      EXPECT_LT(x + 7.0 * static_cast<double>(name.size()), kWidth);
    }
  }
  // One panel also contains the measurements of two sensors.
  texts = TextsOf(Read(folder / "out/figures/measurements.svg"));
  for (int i = 0; i < GetParam(); ++i) {
    EXPECT_EQ(texts["an_estimator_" + std::to_string(i)].size(), 1u) << i;
  }
  EXPECT_EQ(texts["truth"].size(), 2u);  // there is one truth for each stream
}

// The last panel is lower than the others, because it also has texts below its axis.
TEST(FigureKeyOfTheLastPanel, HasAllEstimatorsAndTruthInOneColumn) {
  const TemporaryFolder folder;
  Experiment experiment = MakeExperiment();
  experiment.estimators.clear();
  for (int i = 0; i < 7; ++i) {
    EstimatorSpec named;
    named.name = "an_estimator_" + std::to_string(i);
    const SharedMotion constant = testing::ConstantMotion(1);
    for (const char* entry : {"first", "second"}) {
      AddMotion(named.problem, entry, constant, {{"x", 0.3, 0.1}});
    }
    AddMotion(named.problem, "target", constant, {{"depth", 0.3, 0.1}});
    named.estimator =
        std::make_unique<Ekf>(named.problem, EkfOptions{}, experiment.source->streams());
    experiment.estimators.push_back(std::move(named));
  }
  Recorder recorder(OptionsFor(folder / "out", false, true), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  if (recorder.note().ends_with("not installed")) GTEST_SKIP() << recorder.note();
  auto texts = TextsOf(Read(folder / "out/figures/comparison.svg"));
  ASSERT_EQ(texts["truth"].size(), 1u);
  for (int i = 0; i < 7; ++i) {
    const std::string name = "an_estimator_" + std::to_string(i);
    ASSERT_EQ(texts[name].size(), 3u) << name;
    EXPECT_NEAR(texts[name][2], texts["truth"][0], 1.0) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Estimators, FigureKey, ::testing::Values(2, 5, 6, 8));

}  // namespace
}  // namespace alidade::testing
