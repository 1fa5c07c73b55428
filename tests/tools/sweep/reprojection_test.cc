// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/reprojection.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/recording.h"

namespace alidade::internal {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

SweepRun RunWithErrors(std::vector<double> rms, bool diverged = false) {
  SweepRun run;
  SweepRow& one = run.estimators.emplace_back();
  one.name = "ekf";
  one.diverged = diverged;
  run.reprojection.push_back({"ekf", "pixels", "px", std::move(rms)});
  return run;
}

VariedSweep SweepOfTwoLevels() {
  VariedSweep sweep{{"source.sigma_px", {"0.5", "2"}}, {}};
  sweep.results.resize(2);
  // The errors are in px. The mean of a frame uses the runs that have this frame and did not
  // diverge.
  sweep.results[0].done = {RunWithErrors({1.0, kNone, 0.25}), RunWithErrors({2.0, kNone}),
                           RunWithErrors({100.0, 100.0, 100.0}, true)};
  sweep.results[1].done = {RunWithErrors({4.0})};
  return sweep;
}

TEST(Reprojection, IsTheMeanOverTheRunsThatCount) {
  const testing::TemporaryFolder folder;
  const OutputFolder output(folder / "out", false);
  WriteReprojection(output, SweepOfTwoLevels());
  EXPECT_EQ(testing::Read(output.partial() / "reprojection.csv"),
            "source.sigma_px,estimator,sensor,unit,frame,runs,rms\n"
            "0.5,ekf,pixels,px,1,2,1.5\n"
            "0.5,ekf,pixels,px,2,0,\n"
            "0.5,ekf,pixels,px,3,1,0.25\n"
            "2,ekf,pixels,px,1,1,4\n");
}

TEST(Reprojection, IsNotWrittenWithoutASensorOfLandmarks) {
  const testing::TemporaryFolder folder;
  const OutputFolder output(folder / "out", false);
  VariedSweep sweep = SweepOfTwoLevels();
  for (SweepResult& result : sweep.results) {
    for (SweepRun& run : result.done) run.reprojection.clear();
  }
  WriteReprojection(output, sweep);
  EXPECT_FALSE(std::filesystem::exists(output.partial() / "reprojection.csv"));
}

}  // namespace
}  // namespace alidade::internal
