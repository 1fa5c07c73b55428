// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/reprojection.h"

#include <gtest/gtest.h>

#include <limits>

#include "alidade/sweep/value_labels.h"
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
            "source.sigma_px,estimator,sensor,frame,runs,rms\n"
            "0.5,ekf,pixels,1,2,1.5\n"
            "0.5,ekf,pixels,2,0,\n"
            "0.5,ekf,pixels,3,1,0.25\n"
            "2,ekf,pixels,1,1,4\n");
}

TEST(Reprojection, HasACurveForEachValue) {
  const testing::TemporaryFolder folder;
  const OutputFolder output(folder / "out", false);
  WriteReprojection(output, SweepOfTwoLevels());
  DrawReprojection(output, SweepOfTwoLevels(), [] { return true; });
  const std::string script = testing::Read(output.partial() / "figures/reprojection.gp");
  for (const char* part :
       {"title 'reprojection error of each frame, by source.sigma_px'", "set ylabel '[px]'",
        "(column(0) >= 0 && column(0) < 3 ? column('rms') : NaN) with lines ls 1 title '0.5'",
        "(column(0) >= 3 && column(0) < 4 ? column('rms') : NaN)", "with lines ls 2 title '2'",
        "set xlabel 'frame'"}) {
    EXPECT_NE(script.find(part), std::string::npos) << part << '\n' << script;
  }
}

TEST(Reprojection, IsNotWrittenWithoutASensorOfLandmarks) {
  const testing::TemporaryFolder folder;
  const OutputFolder output(folder / "out", false);
  VariedSweep sweep = SweepOfTwoLevels();
  for (SweepResult& result : sweep.results) {
    for (SweepRun& run : result.done) run.reprojection.clear();
  }
  WriteReprojection(output, sweep);
  EXPECT_EQ(DrawReprojection(output, sweep, {}), "");
  EXPECT_FALSE(std::filesystem::exists(output.partial() / "reprojection.csv"));
  EXPECT_FALSE(std::filesystem::exists(output.partial() / "figures/reprojection.gp"));
}

using Labels = std::vector<std::string>;

TEST(ValueLabels, HaveOfLongValuesWhatDiffers) {
  EXPECT_EQ(ValueLabels({"0.5", "{a: 1}", "[1, 2]"}), (Labels{"0.5", "{a: 1}", "[1, 2]"}));
  EXPECT_EQ(ValueLabels({"{model: pinhole, width: 640, fx: 260, fy: 260, cx: 320}",
                         "{model: pinhole, width: 640, fx: 525, fy: 525, cx: 320}"}),
            (Labels{"fx: 260, fy: 260", "fx: 525, fy: 525"}));
  EXPECT_EQ(
      ValueLabels({"{a: {b: 1, c: 2}, and: a long map}", "{a: {b: 3, c: 2}, and: a long map}"}),
      (Labels{"a: {b: 1, c: 2}", "a: {b: 3, c: 2}"}));
  EXPECT_EQ(ValueLabels({"a word that is far too long", "another"}),
            (Labels{"a word that is far to...", "another"}));
}

}  // namespace
}  // namespace alidade::internal
