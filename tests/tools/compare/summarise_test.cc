// SPDX-License-Identifier: Apache-2.0
//
// Parts of a comparison: what the data of a run are, how paths are aligned, what runs leave out.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "alidade/base/similarity.h"
#include "alidade/compare/compare.h"
#include "alidade/compare/distance.h"
#include "alidade/record/data_hash.h"
#include "alidade/record/estimate_series.h"
#include "support/systems.h"

namespace alidade {
namespace {

using internal::DataHash;

DataHash HashOf(const std::vector<Frame>& frames, std::vector<StreamInfo> streams = {{"a"}, {"b"}},
                std::vector<StreamInfo> truths = {{"x", 1}}) {
  DataHash hash(std::move(streams), std::move(truths));
  for (const Frame& frame : frames) hash.Add(frame);
  return hash;
}

Frame MakeFrame() {
  Frame frame = testing::FrameAt(0.1, {{0, 1.0}, {1, 2.0}});
  frame.truth = {{0.5}};
  return frame;
}

TEST(DataHash, DependsOnAllThatAnEstimatorSees) {
  const std::string hash = HashOf({MakeFrame()}).measurements();
  const auto changed = [](const auto& change) {
    Frame frame = MakeFrame();
    change(frame);
    return HashOf({frame}).measurements();
  };
  EXPECT_NE(hash, changed([](Frame& f) { f.stamp += 1; }));
  EXPECT_NE(hash, changed([](Frame& f) { f.measurements[0].stamp += 1; }));
  EXPECT_NE(hash, changed([](Frame& f) { f.measurements[0].stream = 1; }));
  EXPECT_NE(hash, changed([](Frame& f) { f.measurements[0].landmark = 3; }));
  EXPECT_NE(hash,
            changed([](Frame& f) { f.measurements[0].values[0] = std::nextafter(1.0, 2.0); }));
  EXPECT_NE(hash, changed([](Frame& f) { f.measurements[0].covariance = {1.0}; }));
  EXPECT_NE(hash, changed([](Frame& f) { f.measurements.pop_back(); }));
  EXPECT_NE(hash, HashOf({MakeFrame(), MakeFrame()}).measurements());
  EXPECT_NE(hash, HashOf({MakeFrame()}, {{"a"}, {"c"}}).measurements());
  EXPECT_EQ(hash, changed([](Frame& f) { f.truth = {{0.7}}; }));
}

TEST(DataHash, IsOfContentNotOfItsOrderOrSign) {
  Frame turned = MakeFrame();
  std::swap(turned.measurements[0], turned.measurements[1]);
  EXPECT_EQ(HashOf({MakeFrame()}).measurements(), HashOf({turned}).measurements());
  // The streams of another source, by the same names in another order.
  Frame other = MakeFrame();
  other.measurements[0].stream = 1;
  other.measurements[1].stream = 0;
  EXPECT_EQ(HashOf({MakeFrame()}).measurements(), HashOf({other}, {{"b"}, {"a"}}).measurements());
  // Of two of one stream the order is theirs.
  const Frame twice = testing::FrameAt(0.1, {{0, 1.0}, {0, 2.0}});
  const Frame back = testing::FrameAt(0.1, {{0, 2.0}, {0, 1.0}});
  EXPECT_NE(HashOf({twice}).measurements(), HashOf({back}).measurements());
  const auto of_value = [](double value) {
    return HashOf({testing::FrameAt(0.1, {{0, value}})}).measurements();
  };
  EXPECT_EQ(of_value(0.0), of_value(-0.0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(of_value(nan), of_value(-nan));
}

TEST(DataHash, OfTruthsIsApart) {
  Frame other = MakeFrame();
  other.truth = {{0.25}};
  EXPECT_NE(HashOf({MakeFrame()}).truth(), HashOf({other}).truth());
  other.truth = {{}};
  EXPECT_EQ(HashOf({other}).truth(), "");
  EXPECT_EQ(HashOf({}).truth(), "");
}

/// A path that turns, and what a similarity makes of it.
std::vector<Eigen::Vector3d> Path() {
  std::vector<Eigen::Vector3d> path;
  for (int k = 0; k < 40; ++k) {
    const double t = 0.2 * k;
    path.emplace_back(100.0 + t, std::sin(t), std::cos(2.0 * t));
  }
  return path;
}

TEST(PathAlignment, FindsASimilarity) {
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, -2, 3).normalized());
  internal::PathAlignment alignment;
  for (const Eigen::Vector3d& p : Path()) {
    alignment.Add(p, 2.0 * (turn * p) + Eigen::Vector3d(1.0, -2.0, 0.5));
  }
  const auto aligned = alignment.Result();
  ASSERT_TRUE(aligned);
  EXPECT_NEAR(aligned->scale, 2.0, 1e-12);
  EXPECT_LT(aligned->rmse, 1e-6);
}

// Against Eigen's, which takes all points at once; a mirrored path needs the sign of D.
TEST(PathAlignment, AgreesWithUmeyamaOnNoisyAndMirroredPaths) {
  for (const double mirror : {1.0, -1.0}) {
    const std::vector<Eigen::Vector3d> path = Path();
    Eigen::Matrix3Xd points(3, 40), onto = points;
    internal::PathAlignment alignment;
    for (Eigen::Index k = 0; k < 40; ++k) {
      points.col(k) = path[static_cast<std::size_t>(k)];
      const auto t = static_cast<double>(k);
      const Eigen::Vector3d noise(std::sin(37.0 * t), std::cos(11.0 * t), std::sin(5.0 * t));
      onto.col(k) = points.col(k) + 0.1 * noise;
      onto(2, k) *= mirror;
      alignment.Add(points.col(k), onto.col(k));
    }
    const auto expected = internal::AlignBySimilarity(points, onto);
    const auto aligned = alignment.Result();
    ASSERT_TRUE(expected && aligned);
    EXPECT_NEAR(aligned->rmse, expected->rmse, 1e-9 * expected->rmse) << mirror;
    EXPECT_NEAR(aligned->scale, expected->scale, 1e-9) << mirror;
  }
}

TEST(PathAlignment, OfAPointThereIsNone) {
  internal::PathAlignment alignment;
  for (int k = 0; k < 5; ++k) alignment.Add({1, 2, 3}, {1, 2, 3});
  EXPECT_FALSE(alignment.Result());
}

/// A series of one scalar block and a quaternion, with variances alone.
internal::Series TwoBlocks() {
  internal::Series series;
  series.blocks = {{"a.x", "m", Geometry::Vector(1)}, {"a.q", "", Geometry::UnitQuaternion()}};
  series.joint = false;
  return series;
}

// q and -q are one rotation; distances are taken in the tangent of the reference.
TEST(Series, DistancesAreOfTheTangentAndOfSharedStamps) {
  internal::Series series = TwoBlocks(), reference = TwoBlocks();
  series.stamps = {10, 20, 30};
  series.values = {9, 1, 0, 0, 0, 1.5, -1, 0, 0, 0, 2.0, std::cos(0.1), std::sin(0.1), 0, 0};
  series.covariances.assign(12, 1.0);
  reference.stamps = {20, 30, 40};
  reference.values = {1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0};
  reference.covariances.assign(12, 0.25);
  const internal::Distance distance = internal::DistanceBetween(series, reference);
  EXPECT_NEAR(distance.rms.at("a.x"), std::sqrt((0.25 + 1.0) / 2.0), 1e-15);
  EXPECT_NEAR(distance.final.at("a.x"), 1.0, 1e-15);
  EXPECT_NEAR(distance.final.at("a.q"), 0.2, 1e-12);
  // (0.5^2 + 1^2 + 0.2^2) / 0.25, over two stamps and four degrees of freedom.
  EXPECT_NEAR(distance.sigmas.at("a"), std::sqrt((0.25 + 1.0 + 0.04) / 0.25 / 8.0), 1e-12);
}

TEST(Series, WhatHasNoValueOrVarianceIsLeftOut) {
  const double nan = std::nan("");
  internal::Series series = TwoBlocks(), reference = TwoBlocks();
  series.stamps = reference.stamps = {10, 20};
  series.values = {nan, 1, 0, 0, 0, 3, 1, 0, 0, 0};
  reference.values = {1, 1, 0, 0, 0, 1, 1, 0, 0, 0};
  series.covariances = reference.covariances = {1, 1, 1, 1, 0, 1, 1, 1};
  const internal::Distance distance = internal::DistanceBetween(series, reference);
  EXPECT_EQ(distance.rms.at("a.x"), 2.0);
  EXPECT_FALSE(distance.sigmas.contains("a"));  // one is no number, the other known exactly
}

// What is fixed in both says nothing; what the reference alone fixes has no share in its P.
TEST(Series, FixedBlocksTakeNothingFromTheOthers) {
  const double nan = std::nan("");
  internal::Series series = TwoBlocks(), reference = TwoBlocks();
  series.stamps = reference.stamps = {10};
  series.values = {3, 1, 0, 0, 0};
  reference.values = {1, 1, 0, 0, 0};
  series.covariances = {1, 1, 1, 1};
  reference.covariances = {4, nan, nan, nan};
  reference.blocks[1].constant = true;
  internal::Distance distance = internal::DistanceBetween(series, reference);
  EXPECT_NEAR(distance.sigmas.at("a"), 1.0, 1e-15);
  EXPECT_TRUE(distance.rms.contains("a.q"));
  series.blocks[1].constant = true;
  distance = internal::DistanceBetween(series, reference);
  EXPECT_NEAR(distance.sigmas.at("a"), 1.0, 1e-15);
  EXPECT_FALSE(distance.rms.contains("a.q"));
}

/// A run of two estimators, the second one the reference of the first.
Comparison OneRun(double error, bool filter_diverged = false) {
  Comparison one;
  one.explained = "ekf";
  one.estimators.resize(2);
  ComparedEstimator& filter = one.estimators[0];
  filter.name = "ekf";
  filter.diverged = filter_diverged ? 1 : 0;
  filter.values["rmse:x"] = {error, error, error, error};
  if (!filter_diverged) {
    filter.reference = filter.final_reference = "batch";
    filter.reference_runs = filter.final_reference_runs = 1;
    filter.values["ratio.rmse:x"] = filter.values["rmse:x"];
  }
  one.estimators[1].name = "batch";
  DecompositionStep& step = one.decomposition.emplace_back();
  step.kind = DecompositionKind::kRejected;
  step.from = "accepted";
  step.to = "batch";
  step.values["rejected"] = {error, error, error, error};
  return one;
}

// What is lost by a filter that diverged is no figure of the filter.
TEST(Summarise, LeavesOutTheRunsInWhichTheFilterDiverged) {
  const Comparison all = Summarise({OneRun(6.0, true), OneRun(1.0), OneRun(2.0)});
  EXPECT_EQ(all.runs, 3);
  const ComparedEstimator& filter = all.estimators[0];
  EXPECT_EQ(filter.diverged, 1);
  EXPECT_EQ(filter.used, 2);
  EXPECT_EQ(filter.reference, "batch");
  EXPECT_EQ(filter.reference_runs, 2);
  EXPECT_EQ(filter.values.at("rmse:x").mean, 1.5);
  EXPECT_NEAR(filter.values.at("rmse:x").p50, 1.5, 1e-15);
  EXPECT_EQ(filter.values.at("ratio.rmse:x").mean, 1.5);
  EXPECT_EQ(all.estimators[1].used, 3);
  EXPECT_EQ(all.decomposition[0].values.at("rejected").mean, 1.5);
}

// That an estimator of one of them failed is told of it.
TEST(Summarise, OfSeedsHasTheStatusOfTheSweep) {
  Comparison failed = OneRun(1.0);
  failed.status = RunStatus::kFailed;
  EXPECT_EQ(Summarise({failed}).status, RunStatus::kOk);
  EXPECT_EQ(Summarise({OneRun(1.0), failed}).status, RunStatus::kOk);
}

TEST(Summarise, SaysInHowManyRunsANoteHolds) {
  Comparison one = OneRun(1.0), two = OneRun(2.0);
  one.notes = {"both"};
  two.notes = {"both", "second"};
  EXPECT_EQ(Summarise({one, two}).notes,
            (std::vector<std::string>{"both", "second (1 of 2 runs)"}));
}

TEST(Summarise, TakesAStepBetweenTheSameTwoAlone) {
  Comparison other = OneRun(7.0);
  other.decomposition[0].to = "another";
  EXPECT_EQ(Summarise({OneRun(1.0), other}).decomposition[0].values.at("rejected").mean, 1.0);
}

TEST(Summarise, LeavesOutWhatIsNoNumber) {
  const Comparison all = Summarise({OneRun(1.0), OneRun(std::nan("")), OneRun(3.0)});
  const Spread spread = all.estimators[0].values.at("rmse:x");
  EXPECT_EQ(spread.mean, 2.0);
  EXPECT_NEAR(spread.p95, 2.9, 1e-15);
  EXPECT_TRUE(std::isnan(Summarise({OneRun(std::nan(""))}).estimators[0].values.at("rmse:x").mean));
}

TEST(Summarise, CountsTheRunsWithoutAReference) {
  Comparison without = OneRun(1.0);
  without.withheld = "no reference: estimator 'batch' failed, the comparison with it is withheld";
  const Comparison all = Summarise({OneRun(1.0), without});
  EXPECT_EQ(all.withheld, without.withheld + " (1 of 2 runs)");
}

TEST(CompareReport, LatexIsSafe) {
  Comparison one = OneRun(1.0);
  one.notes = {"50 % of $x_1$ {a} \\b ^ ~ # &"};
  const std::string text = CompareReport(one, TableStyle::kLatex);
  EXPECT_NE(text.find("50 \\% of \\$x\\_1\\$ \\{a\\} \\textbackslash{}b \\^{} \\~{} \\# \\&"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace alidade
