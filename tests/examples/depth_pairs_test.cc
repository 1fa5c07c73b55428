// SPDX-License-Identifier: Apache-2.0
//
// Checks the arithmetic of the bench accuracy_depth_pairs. Also runs example 07 on the real series
// that were not used for tuning, and compares the filter with the line d = c s.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "bench/accuracy/bootstrap.h"
#include "bench/accuracy/pair_series.h"
#include "bench/accuracy/read_pair_series.h"

namespace alidade {
namespace {

using bench::PairSeries;

// f B = 400 px m and the first depth is 40 m, so without noise d = 10 s. Only the first two rows
// have a disparity.
PairSeries FourRows() {
  return {"made up",
          400.0,
          {{0.0, 10.0, 1.0, 40.0},
           {0.1, 12.5, 1.25, 32.0},
           {0.2, NAN, 1.6, 25.0},
           {0.3, NAN, 2.0, 20.0}},
          2};
}

TEST(PairSeries, TheLineIsExactWithoutNoise) {
  EXPECT_DOUBLE_EQ(LineSlope(FourRows()), 10.0);
  EXPECT_NEAR(LineRmse(FourRows()), 0.0, 1e-12);
}

// c = (11 * 1 + 12.5 * 1.25) / (1 + 1.5625) = 26.625 / 2.5625 px; 400 / c = 38.497653 m. The
// computed depth is 3.7559 % too small, which is 0.93897 m at 25 m and 0.75117 m at 20 m.
TEST(PairSeries, TheLineIsFittedOverTheSeenHalf) {
  PairSeries series = FourRows();
  series.rows[0].disparity_px = 11.0;
  EXPECT_NEAR(LineSlope(series), 26.625 / 2.5625, 1e-12);
  const double k = 400.0 * 2.5625 / 26.625;
  const double a = k / 1.6 - 25.0, b = k / 2.0 - 20.0;
  EXPECT_NEAR(LineRmse(series), std::sqrt((a * a + b * b) / 2.0), 1e-12);
  EXPECT_NEAR(LineRmse(series), 0.85027, 1e-5);
}

// The last scale is 2 % too large. If the distance at the masking is known, the computed depths are
// 25 m, which is exact, and 40 / 2.04 = 19.6078 m instead of 20 m. The best constant is
// k = (25 / 1.6 + 20 / 2.04) / (1 / 2.56 + 1 / 4.1616) = 40.3020 m.
TEST(PairSeries, WhatDriftLeaves) {
  PairSeries series = FourRows();
  series.rows[3].scale = 2.04;
  series.rows[0].depth_m = 41.0;  // rows before the masking have no effect
  EXPECT_NEAR(AnchoredRmse(series), (20.0 - 40.0 / 2.04) / std::sqrt(2.0), 1e-12);
  const double k = (25.0 / 1.6 + 20.0 / 2.04) / (1.0 / 2.56 + 1.0 / 4.1616);
  const double a = k / 1.6 - 25.0, b = k / 2.04 - 20.0;
  EXPECT_NEAR(BestConstantRmse(series), std::sqrt((a * a + b * b) / 2.0), 1e-12);
  EXPECT_LT(BestConstantRmse(series), AnchoredRmse(series));
  EXPECT_LT(BestConstantRmse(series), bench::BlindRmse(series, k * 1.001));
  EXPECT_LT(BestConstantRmse(series), bench::BlindRmse(series, k * 0.999));
}

// log(s Z) grows by 0, 0 and log(1.02) between consecutive rows.
TEST(PairSeries, DriftIsTheGrowthOfScaleTimesDepth) {
  PairSeries series = FourRows();
  series.rows[3].scale = 2.04;
  const double square = std::log(1.02) * std::log(1.02);
  EXPECT_NEAR(DriftVariance(series, 1), square / 3.0, 1e-12);
  EXPECT_NEAR(DriftVariance(series, 2), square / 2.0, 1e-12);
}

TEST(PairSeries, WhiteNoiseIsWhatBendsARamp) {
  PairSeries series;
  series.seen_count = 1000;
  Random random(3);
  const auto depth = [](const bench::PairRow& row) { return row.depth_m; };
  for (int i = 0; i < 1100; ++i) series.rows.push_back({0.1 * i, 0.0, 1.0, 50.0 - 0.5 * i});
  EXPECT_NEAR(WhiteVariance(series, depth), 0.0, 1e-20);
  for (auto& row : series.rows) row.depth_m += 0.2 * random.Normal();
  for (std::size_t i = series.seen_count; i < series.rows.size(); ++i)
    series.rows[i].depth_m = 1e6 * random.Normal();
  // The mean of 998 overlapping squares has a standard deviation of about 6 % of its value.
  EXPECT_NEAR(WhiteVariance(series, depth), 0.04, 0.008);
}

// For 400 normal values with sigma 2, the bounds of the interval are close to the mean -+ 0.196,
// because 1.96 * 2 / sqrt(400) = 0.196.
TEST(Bootstrap, IsTheIntervalOfTheMean) {
  Random random(1);
  std::vector<double> values(400);
  for (double& v : values) v = 5.0 + 2.0 * random.Normal();
  const Interval interval = bench::BootstrapOfMean(values);
  EXPECT_NEAR(interval.low, Mean(values) - 0.196, 0.02);
  EXPECT_NEAR(interval.high, Mean(values) + 0.196, 0.02);
}

// The mean of two draws from {0, 1} is 0, 1/2 or 1, with probabilities 1/4, 1/2 and 1/4.
TEST(Bootstrap, DrawsWithReplacement) {
  const Interval interval = bench::BootstrapOfMean({0.0, 1.0});
  EXPECT_EQ(interval.low, 0.0);
  EXPECT_EQ(interval.high, 1.0);
  EXPECT_EQ(bench::BootstrapOfMean({3.0, 3.0}).low, 3.0);
}

Experiment RealPairs(const std::filesystem::path& file, const PluginHost& host) {
  Config config = Config::FromFile(std::filesystem::path(ALIDADE_SOURCE_DIR) /
                                   "examples/07_depth_pairs/config.yaml");
  config.Set("source.path", file.string(), "test");
  config.Set("source.blind_after", "0.5", "test");
  return BuildExperiment(config, host);
}

// The filter was tuned on the 1st, 3rd, ... series, sorted by name. This test uses the other
// series.
TEST(DepthPairs, FusedIsNoWorseThanTheLineOnTheReportedSeries) {
  const char* data = std::getenv("ALIDADE_DATA");
  const auto folder = std::filesystem::path(data == nullptr ? "" : data) / "kitti-depth-pairs";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "ALIDADE_DATA does not contain kitti-depth-pairs";
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  const PluginHost host(std::vector<std::filesystem::path>{});
  std::vector<double> differences;
  for (std::size_t i = 1; i < files.size(); i += 2) {
    Experiment read = RealPairs(files[i], host), run = RealPairs(files[i], host);
    const double line = LineRmse(bench::ReadPairSeries(*read.source, files[i].stem()));
    const RunResult result = alidade::Run(run, {});
    differences.push_back(
        std::log(result.estimators.at(0).metrics.at("rmse:target.depth@blind") / line));
  }
  EXPECT_LE(Mean(differences), 0.0);
  // If the whole interval were above 0, the filter would be significantly worse than the line.
  EXPECT_LT(bench::BootstrapOfMean(differences).low, 0.0);
}

}  // namespace
}  // namespace alidade
