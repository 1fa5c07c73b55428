// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/worst_seeds.h"

#include <gtest/gtest.h>

#include <limits>

namespace alidade::internal {
namespace {

SweepRun RunOf(std::uint64_t seed, const std::map<std::string, double>& metrics) {
  EstimatorResult result;
  result.name = "ekf";
  result.metrics = metrics;
  result.units = {{"target.depth", "m"}};
  SweepRun run;
  run.seed = seed;
  run.estimators.emplace_back(result);
  return run;
}

/// Returns five runs whose RMSE of the depth is the seed, in m. Seed 9 diverged, and seed 11
/// failed.
SweepResult FiveRuns() {
  SweepResult result;
  result.estimators = {"ekf"};
  for (const int seed : {3, 9, 1, 11, 5}) {
    result.done.push_back(
        RunOf(static_cast<std::uint64_t>(seed), {{"rmse:target.depth", 1.0 * seed}}));
  }
  result.done[1].estimators[0].diverged = true;
  result.done[3].status = RunStatus::kFailed;
  return result;
}

TEST(WorstSeeds, AreFinishedRunsWithTheLargestErrors) {
  const std::vector<WorstSeeds> worst = FindWorstSeeds(FiveRuns());
  ASSERT_EQ(worst.size(), 1u);
  EXPECT_EQ(worst[0].seeds, (std::vector<std::uint64_t>{9, 5, 3}));
  EXPECT_EQ(WorstSeedLines(worst),
            "\nworst seeds of ekf by rmse target.depth: 9 (9.00 m), 5 (5.00 m), 3 (3.00 m)\n");
}

TEST(WorstSeeds, AreRankedByNeesIfItExists) {
  SweepResult result = FiveRuns();
  for (const std::uint64_t seed : {20u, 21u, 22u, 23u}) {
    result.done.push_back(RunOf(seed, {{"rmse:target.depth", 1.0},
                                       {"nees.mean:target@end", 100.0},
                                       {"nees.mean:target", 30.0 - static_cast<double>(seed)}}));
  }
  result.done.push_back(
      RunOf(30, {{"nees.mean:target", std::numeric_limits<double>::quiet_NaN()}}));
  EXPECT_EQ(FindWorstSeeds(result).at(0).seeds, (std::vector<std::uint64_t>{20, 21, 22}));
}

TEST(WorstSeeds, AreOmittedIfTheyAreAllSeeds) {
  SweepResult result = FiveRuns();
  result.done.erase(result.done.begin());
  EXPECT_TRUE(FindWorstSeeds(result).empty());
  EXPECT_EQ(WorstSeedLines({}), "");
}

}  // namespace
}  // namespace alidade::internal
