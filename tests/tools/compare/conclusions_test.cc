// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/conclusions.h"

#include <gtest/gtest.h>

namespace alidade::internal {
namespace {

using Lines = std::vector<std::string>;

DecompositionStep StepOf(DecompositionKind kind, double error, double reference_error) {
  DecompositionStep step;
  step.kind = kind;
  step.estimator = "ekf";
  step.reference = "batch";
  step.ratios["rmse:x.position"] = {error, reference_error};
  return step;
}

Comparison ComparisonOf(const DecompositionStep& step) {
  Comparison comparison;
  comparison.decomposed = "ekf";
  comparison.decomposition = {step};
  return comparison;
}

Lines LinesOf(const DecompositionStep& step) {
  return ConclusionLines(ConclusionsOf(ComparisonOf(step)));
}

ComparedEstimator EstimatorOf(const std::string& name, double rmse_m, double cpu_us) {
  ComparedEstimator estimator;
  estimator.name = name;
  estimator.values["rmse:x.position"].mean = rmse_m;
  estimator.values["cpu_us"].mean = cpu_us;
  estimator.units["x.position"] = "m";
  return estimator;
}

TEST(CompareConclusions, LinearisationIsJudgedByTheRatio) {
  const auto lines = [](double error) {
    return LinesOf(StepOf(DecompositionKind::kLinearisation, error, 1.0));
  };
  const std::string end = ": linearising each measurement only once costs nothing that matters.";
  EXPECT_EQ(lines(1.0001),
            Lines{"ekf is as accurate as batch in x.position" + end + " (ratio 1.00)"});
  EXPECT_EQ(lines(1.01), Lines{"ekf is within 1 % of batch in x.position" + end + " (ratio 1.01)"});
  EXPECT_EQ(lines(1.5),
            Lines{"ekf has 50 % more error than batch in x.position, because it linearises each "
                  "measurement only once. (ratio 1.50)"});
}

TEST(CompareConclusions, AnIntervalThatIncludesOneIsNoDifference) {
  DecompositionStep step = StepOf(DecompositionKind::kLinearisation, 1.5, 1.0);
  Ratio& ratio = step.ratios["rmse:x.position"];
  ratio.runs = 20;
  ratio.interval = Interval{0.9, 2.5};
  EXPECT_EQ(LinesOf(step), Lines{"ekf is as accurate as batch in x.position: linearising each "
                                 "measurement only once costs nothing that matters. (ratio 1.5000 "
                                 "[0.9000, 2.5000] undecided)"});
}

TEST(CompareConclusions, SmoothingDividesTheError) {
  EXPECT_EQ(LinesOf(StepOf(DecompositionKind::kSmoothing, 3.0, 2.0)),
            Lines{"Later data would divide the error of ekf in x.position by 1.5: batch reaches "
                  "this error. (ratio 1.50)"});
}

TEST(CompareConclusions, RejectedMeasurementsHaveACost) {
  DecompositionStep step = StepOf(DecompositionKind::kRejected, 1.1, 1.0);
  step.values["measurements"].mean = 100.0;
  step.values["rejected"].mean = 3.0;
  EXPECT_EQ(LinesOf(step), Lines{"ekf did not use 3 of 100 measurements. A batch without them has "
                                 "10 % more error in x.position than a batch of all measurements. "
                                 "(ratio 1.10)"});
  step.values["rejected"].mean = 0.0;
  EXPECT_EQ(LinesOf(step),
            Lines{"ekf used all 100 measurements: the rejection of outliers cost nothing."});
}

TEST(CompareConclusions, TheCheapestIsComparedWithTheMostAccurate) {
  Comparison comparison;
  comparison.estimators = {EstimatorOf("ekf", 2.2e-3, 1.0), EstimatorOf("iekf", 2.0e-3, 5.0),
                           EstimatorOf("lost", 1.0e-3, 0.5)};
  comparison.estimators[2].diverged = 1;
  EXPECT_EQ(
      ConclusionLines(ConclusionsOf(comparison)),
      Lines{"Least error online in x.position: iekf, 2 mm. Least CPU time: ekf, 1 us a frame, "
            "with 10 % more error."});
}

}  // namespace
}  // namespace alidade::internal
