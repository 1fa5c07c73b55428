// SPDX-License-Identifier: Apache-2.0
//
// Tests examples/16_slam_room: a filter estimates the shape of a room on a straight path through
// it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <mutex>
#include <vector>

#include "alidade/sweep/sweep.h"

namespace alidade {
namespace {

/// Mean of one coordinate over the landmarks of a wall. The caller adds only landmarks with a sigma
/// of at most 0.1 m.
class Wall {
 public:
  Wall(int axis, double at) : axis_(axis), at_(at) {}
  void Add(const LandmarkEstimate& landmark) {
    if (std::abs(landmark.true_position[axis_] - at_) > 1e-9) return;
    sum_ += landmark.position[axis_];
    ++count_;
  }
  int count() const { return count_; }
  double place() const { return sum_ / count_; }

 private:
  int axis_;
  double at_, sum_ = 0.0;
  int count_ = 0;
};

TEST(SlamRoom, ItsShapeIsRecovered) {
  Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                   "examples/16_slam_room/config.yaml");
  const PluginHost host(PluginPaths(config));
  SweepOptions options;
  options.runs = 20;
  options.first_seed = 1001;
  std::mutex mutex;
  std::vector<std::vector<LandmarkEstimate>> maps;
  options.run = [&](Experiment& experiment, const RunOptions& given) {
    RunResult result = alidade::Run(experiment, given);
    const std::lock_guard lock(mutex);
    maps.push_back(result.estimators.at(0).landmarks.value());
    return result;
  };
  const SweepResult sweep = Sweep(config, host, options);
  EXPECT_EQ(Summarise(sweep).at(0).diverged + Summarise(sweep).at(0).CountOf(VerdictState::kLost),
            0);
  double squares = 0.0, width = 0.0, height = 0.0, front = 0.0;
  int count = 0;
  for (const SweepRun& run : sweep.done) ASSERT_EQ(run.status, RunStatus::kOk) << run.reason;
  ASSERT_EQ(maps.size(), 20u);
  for (const std::vector<LandmarkEstimate>& map : maps) {
    Wall left(0, -1.5), right(0, 1.5), ceiling(1, -1.2), floor(1, 1.2), ahead(2, 4.0);
    for (const LandmarkEstimate& landmark : map) {
      if (!(landmark.covariance.diagonal().maxCoeff() < 0.1 * 0.1)) continue;
      for (Wall* wall : {&left, &right, &ceiling, &floor, &ahead}) wall->Add(landmark);
      squares += (landmark.position - landmark.true_position).squaredNorm();
      ++count;
    }
    for (const Wall* wall : {&left, &right, &ceiling, &floor, &ahead}) EXPECT_GE(wall->count(), 2);
    // In each run the size of the room has an error of at most 3 %.
    EXPECT_NEAR(right.place() - left.place(), 3.0, 0.09);
    EXPECT_NEAR(floor.place() - ceiling.place(), 2.4, 0.07);
    EXPECT_NEAR(ahead.place(), 4.0, 0.12);
    width += (right.place() - left.place()) / 20.0;
    height += (floor.place() - ceiling.place()) / 20.0;
    front += ahead.place() / 20.0;
  }
  EXPECT_GE(count, 20 * 40);
  EXPECT_LE(std::sqrt(squares / count), 0.040);
  EXPECT_NEAR(width, 3.0, 0.02);
  EXPECT_NEAR(height, 2.4, 0.02);
  EXPECT_NEAR(front, 4.0, 0.03);
}

}  // namespace
}  // namespace alidade
