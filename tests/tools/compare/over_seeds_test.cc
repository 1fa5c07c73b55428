// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/over_seeds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alidade/base/random.h"
#include "alidade/compare/compare.h"

namespace alidade {
namespace {

/// Returns n runs of a filter and its reference. Their errors are e = 1.1 r + N(0, 0.1^2) and
/// r ~ 3 + N(0, 0.5^2).
std::vector<Ratio> CorrelatedRuns(int n) {
  Random random(7);
  std::vector<Ratio> runs;
  for (int i = 0; i < n; ++i) {
    const double reference = 3.0 + 0.5 * random.Normal();
    runs.push_back({1.1 * reference + 0.1 * random.Normal(), reference});
  }
  return runs;
}

// The delta method independently gives the same interval, rho -+ 1.96 sigma, with
// sigma^2 = var(mean(e) / mean(r)) = mean((e - rho r)^2) / (n mean(r)^2).
// With 5000 samples a quantile at 2.5 % has an error of
// sigma sqrt(0.025 * 0.975 / 5000) / 0.0584 = 0.04 sigma. The test allows four times this error.
TEST(RatioOfMeans, HasTheIntervalOfTheDeltaMethod) {
  const std::vector<Ratio> runs = CorrelatedRuns(400);
  const Ratio ratio = RatioOfMeans(runs);
  double error = 0.0, reference = 0.0;
  for (const Ratio& run : runs) {
    error += run.error / 400.0;
    reference += run.reference_error / 400.0;
  }
  EXPECT_NEAR(ratio.value(), error / reference, 1e-13);
  EXPECT_EQ(ratio.runs, 400);
  double square = 0.0;
  for (const Ratio& run : runs) {
    square += std::pow(run.error - ratio.value() * run.reference_error, 2) / 400.0;
  }
  const double sigma = std::sqrt(square / 400.0) / reference;
  EXPECT_NEAR(ratio.interval->low, ratio.value() - 1.96 * sigma, 0.16 * sigma);
  EXPECT_NEAR(ratio.interval->high, ratio.value() + 1.96 * sigma, 0.16 * sigma);
}

// The difficulty of a run affects the errors of both estimators equally, so the difficulty cancels
// in the ratio. Without pairing the interval would not have zero width.
TEST(RatioOfMeans, IsPaired) {
  Random random(3);
  std::vector<Ratio> runs;
  for (int i = 0; i < 50; ++i) {
    const double reference = std::exp(random.Normal());
    runs.push_back({1.25 * reference, reference});
  }
  const Ratio ratio = RatioOfMeans(runs);
  EXPECT_NEAR(ratio.interval->low, 1.25, 1e-12);
  EXPECT_NEAR(ratio.interval->high, 1.25, 1e-12);
}

// The two runs have the ratios 1 / 2 and 3 / 2. A resampled pair has the sums 2 / 4, 4 / 4 or 6 / 4
// with probabilities 1/4, 1/2 and 1/4. The result is 1, the ratio of the means, not the mean of the
// ratios of the runs.
TEST(RatioOfMeans, OfTwoRunsIsEnumerated) {
  const Ratio ratio = RatioOfMeans({{1.0, 2.0}, {3.0, 2.0}});
  EXPECT_EQ(ratio.value(), 1.0);
  EXPECT_EQ(ratio.interval->low, 0.5);
  EXPECT_EQ(ratio.interval->high, 1.5);
  EXPECT_TRUE(ratio.undecided());
  EXPECT_EQ(RatioOfMeans({{1.0, 1.0}, {9.0, 4.0}}).value(), 2.0);
}

TEST(RatioOfMeans, IsTheSameEachTime) {
  const std::vector<Ratio> runs = CorrelatedRuns(30);
  const Ratio one = RatioOfMeans(runs), two = RatioOfMeans(runs);
  EXPECT_EQ(one.interval->low, two.interval->low);
  EXPECT_EQ(one.interval->high, two.interval->high);
  EXPECT_FALSE(one.undecided());
}

TEST(RatioOfMeans, OfOneRunHasNoInterval) {
  const Ratio ratio = RatioOfMeans({{3.0, 2.0}});
  EXPECT_EQ(ratio.value(), 1.5);
  EXPECT_FALSE(ratio.interval.has_value());
  EXPECT_FALSE(ratio.undecided());
}

TEST(IntervalOfMean, IsThatOfTheNormalDistribution) {
  Random random(1);
  std::vector<double> values(400);
  double mean = 0.0;
  for (double& v : values) mean += (v = 5.0 + 2.0 * random.Normal()) / 400.0;
  const Interval interval = IntervalOfMean(values);
  EXPECT_NEAR(interval.low, mean - 0.196, 0.02);
  EXPECT_NEAR(interval.high, mean + 0.196, 0.02);
}

/// Returns a run of one block and one owner, with the given errors and NEES at the timestamps 10,
/// 20, ...
ErrorSeries SeriesOf(const std::vector<double>& errors, const std::vector<double>& nees) {
  ErrorSeries series;
  series.blocks = {"p.x"};
  series.owners = {"p"};
  series.angles = {false};
  for (std::size_t k = 0; k < errors.size(); ++k) {
    series.timestamps.push_back(10 * static_cast<Timestamp>(k + 1));
    series.squares.push_back(errors[k] * errors[k]);
    series.nees.push_back(nees[k]);
    series.dofs.push_back(2.0);
  }
  return series;
}

OverTime Over(const std::vector<ErrorSeries>& runs) {
  std::vector<const ErrorSeries*> pointers;
  for (const ErrorSeries& run : runs) pointers.push_back(&run);
  return ComputeOverTime(pointers);
}

// The tabulated quantiles of chi-square with 10 degrees of freedom are 3.247 at 0.025 and 20.483 at
// 0.975 [BarShalom2001, table 1.5.4-1]. Five runs with two degrees of freedom each have ten degrees
// of freedom.
TEST(ComputeOverTime, AverageNeesHasTheBoundsOfChiSquare) {
  std::vector<ErrorSeries> runs;
  for (const double nees : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    runs.push_back(SeriesOf({1.0, 1.0}, {nees, 2.0 * nees}));
  }
  const OverTime::AverageNees nees = Over(runs).nees.at("p");
  EXPECT_EQ(nees.mean, (std::vector<double>{1.5, 3.0}));
  EXPECT_NEAR(nees.low[0], 0.3247, 5e-5);
  EXPECT_NEAR(nees.high[0], 2.0483, 5e-5);
  EXPECT_EQ(nees.timestamps, 2);
  EXPECT_EQ(nees.inside, 0.5);
}

// 200 runs have NEES ~ chi2(2), so 95 % of 500 independent timestamps are expected inside the
// bounds. This proportion has a standard deviation of sqrt(0.95 * 0.05 / 500) = 1 %.
TEST(ComputeOverTime, AverageNeesOfAConsistentFilterIsInside) {
  Random random(5);
  std::vector<ErrorSeries> runs;
  for (int r = 0; r < 200; ++r) {
    std::vector<double> nees(500);
    for (double& v : nees) v = std::pow(random.Normal(), 2) + std::pow(random.Normal(), 2);
    runs.push_back(SeriesOf(std::vector<double>(500, 1.0), nees));
  }
  EXPECT_NEAR(Over(runs).nees.at("p").inside, 0.95, 0.03);
}

TEST(ComputeOverTime, ErrorsHaveRmsAndQuantiles) {
  std::vector<ErrorSeries> runs;
  for (int r = 0; r <= 100; ++r) runs.push_back(SeriesOf({0.01 * r}, {1.0}));
  const OverTime::Error error = Over(runs).errors.at("p.x");
  // The sum of r^2 for r = 0 to 100 is 100 * 101 * 201 / 6.
  EXPECT_NEAR(error.rms[0], 0.01 * std::sqrt(100.0 * 201.0 / 6.0), 1e-12);
  EXPECT_NEAR(error.low[0], 0.16, 1e-12);
  EXPECT_NEAR(error.high[0], 0.84, 1e-12);
}

TEST(ComputeOverTime, BoundsAreRmsAndThereWhereAllRunsHaveThem) {
  ErrorSeries one = SeriesOf({1.0, 1.0}, {1.0, 1.0}), two = one, three = one;
  one.bounds = {1.0, 4.0};
  two.bounds = {3.0, 8.0};
  const OverTime::Error error = Over({one, two}).errors.at("p.x");
  EXPECT_EQ(error.bound, (std::vector<double>{std::sqrt(2.0), std::sqrt(6.0)}));
  EXPECT_TRUE(Over({one, two, three}).errors.at("p.x").bound.empty());
}

TEST(ComputeOverTime, TimestampsOfOneRunAloneAndWhatIsNoNumberAreLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const OverTime over =
      Over({SeriesOf({nan, 1.0, 5.0}, {nan, 2.0, 2.0}), SeriesOf({2.0, 3.0}, {1.0, 4.0})});
  EXPECT_EQ(over.timestamps, (std::vector<Timestamp>{10, 20}));
  EXPECT_TRUE(std::isnan(over.errors.at("p.x").rms[0]));
  EXPECT_NEAR(over.errors.at("p.x").rms[1], std::sqrt(5.0), 1e-15);
  EXPECT_EQ(over.nees.at("p").timestamps, 1);
  EXPECT_EQ(over.nees.at("p").mean[1], 1.5);
}

}  // namespace
}  // namespace alidade
