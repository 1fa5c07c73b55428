// SPDX-License-Identifier: Apache-2.0
//
// Tests the parts of a displayed frame: its features, and the map from above.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "alidade/record/feature_trails.h"
#include "alidade/record/map_from_above.h"

namespace alidade {
namespace {

using internal::FeatureTrails;
using internal::MapFromAbove;

Frame PixelsOf(const std::vector<std::pair<std::int64_t, std::vector<double>>>& features) {
  Frame frame;
  for (const auto& [id, values] : features) frame.measurements.push_back({0, 0, id, values, {}});
  return frame;
}

void AddReport(UpdateReport& report, std::int64_t landmark, Outcome outcome) {
  MeasurementReport& one = report.Add();
  one.sensor = 0;
  one.landmark = landmark;
  one.dof = 2;
  one.outcome = outcome;
}

TEST(FeatureTrails, TheOutcomeIsTheMark) {
  EXPECT_EQ(internal::MarkOf(Outcome::kAccepted), Mark::kAccepted);
  EXPECT_EQ(internal::MarkOf(Outcome::kGated), Mark::kRejected);
  EXPECT_EQ(internal::MarkOf(Outcome::kInitialised), Mark::kNew);
  EXPECT_EQ(internal::MarkOf(Outcome::kNotReady), Mark::kNew);
  EXPECT_EQ(internal::MarkOf(Outcome::kOutOfDomain), Mark::kUnused);
  EXPECT_EQ(internal::MarkOf(Outcome::kEnded), Mark::kUnused);
}

TEST(FeatureTrails, WhatIsNotSeenAnyMoreIsLostOnce) {
  FeatureTrails trails;
  UpdateReport report;
  AddReport(report, 4, Outcome::kAccepted);
  ASSERT_EQ(trails.Add(PixelsOf({{4, {10, 20}}}), &report).size(), 1u);
  const std::vector<ViewFeature> lost = trails.Add(PixelsOf({}), nullptr);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].mark, Mark::kLost);
  EXPECT_EQ(lost[0].pixel, (std::array<double, 2>{10, 20}));
  EXPECT_TRUE(trails.Add(PixelsOf({}), nullptr).empty());
}

// A feature without a report is `new` until its first accepted measurement. Afterwards it is
// `unused`.
TEST(FeatureTrails, WithoutAReportAFeatureIsNewUntilItIsAccepted) {
  FeatureTrails trails;
  UpdateReport none, accepted;
  AddReport(accepted, 4, Outcome::kAccepted);
  EXPECT_EQ(trails.Add(PixelsOf({{4, {10, 20}}}), &none)[0].mark, Mark::kNew);
  EXPECT_EQ(trails.Add(PixelsOf({{4, {11, 20}}}), &accepted)[0].mark, Mark::kAccepted);
  EXPECT_EQ(trails.Add(PixelsOf({{4, {12, 20}}}), &none)[0].mark, Mark::kUnused);
}

TEST(FeatureTrails, TheTailHasTheEightPlacesBefore) {
  FeatureTrails trails;
  for (int k = 0; k < 12; ++k) {
    const double u = k;
    const std::vector<ViewFeature> features = trails.Add(PixelsOf({{4, {u, 0}}}), nullptr);
    ASSERT_EQ(features[0].trail.size(), static_cast<std::size_t>(std::min(k, 8)));
    if (k > 0) {
      EXPECT_EQ(features[0].trail.back()[0], u - 1.0);
    }
  }
}

TEST(FeatureTrails, ThePredictionIsHAndTheFirstTwoOfS) {
  UpdateReport report;
  AddReport(report, 4, Outcome::kAccepted);
  MeasurementReport& one = report.measurements()[0];
  one.dof = 3;  // the elements are u, v and the depth
  one.h = report.Copy(std::vector{11.0, 21.0, 5.0});
  one.s = report.Copy(std::vector{4.0, 1.0, 0.1, 1.0, 9.0, 0.2, 0.1, 0.2, 0.3});
  FeatureTrails trails;
  const auto predicted = trails.Add(PixelsOf({{4, {10, 20, 5}}}), &report)[0].predicted;
  ASSERT_TRUE(predicted);
  EXPECT_EQ(predicted->x, 11);
  EXPECT_EQ(predicted->y, 21);
  EXPECT_EQ(predicted->xx, 4);
  EXPECT_EQ(predicted->xy, 1);
  EXPECT_EQ(predicted->yy, 9);
}

TEST(FeatureTrails, WhatIsNoPixelIsNoFeature) {
  FeatureTrails trails;
  EXPECT_TRUE(trails.Add(PixelsOf({{-1, {1, 2}}, {3, {7}}}), nullptr).empty());
}

const Eigen::Matrix3d kNoTurn = Eigen::Matrix3d::Identity();

// The camera looks along z, and its y axis points down. In the map, x points right and z points up.
TEST(MapFromAbove, ACameraIsSeenFromAbove) {
  MapFromAbove above;
  Eigen::Matrix3d p;
  p << 1, 2, 3, 2, 5, 6, 3, 6, 9;
  above.Add({0.5, -0.1, 2.0}, p, kNoTurn, nullptr, {});
  const ViewMap& map = *above.map();
  EXPECT_EQ(map.right, "x");
  EXPECT_EQ(map.up, "z");
  EXPECT_EQ(map.path, (std::vector<std::array<double, 2>>{{0.5, 2.0}}));
  EXPECT_EQ(map.heading, (std::array<double, 2>{0.0, 1.0}));
  EXPECT_EQ(map.position.xx, 1);
  EXPECT_EQ(map.position.xy, 3);
  EXPECT_EQ(map.position.yy, 9);
}

// The y axis of the camera points along -z of the world, so z is up in the world. The camera looks
// along y.
TEST(MapFromAbove, TheWorldMayHaveZUp) {
  Eigen::Matrix3d world_from_body;
  world_from_body << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  MapFromAbove above;
  above.Add({0.5, 3.0, 2.0}, kNoTurn, world_from_body, nullptr, {});
  EXPECT_EQ(above.map()->right, "x");
  EXPECT_EQ(above.map()->up, "y");
  EXPECT_EQ(above.map()->heading, (std::array<double, 2>{0.0, 1.0}));
}

// 100 landmarks are at x = 0 to 99 m, and one is at 10 km. The farthest landmarks are outside the
// view.
TEST(MapFromAbove, OneFarLandmarkDoesNotHideTheOthers) {
  std::vector<LandmarkEstimate> landmarks(101);
  for (int i = 0; i <= 100; ++i) {
    landmarks[static_cast<std::size_t>(i)].position = {i == 100 ? 1e4 : i, 0.0, 5.0};
    landmarks[static_cast<std::size_t>(i)].covariance.setIdentity();
  }
  landmarks.emplace_back();  // a landmark that is not yet initialised
  MapFromAbove above;
  above.Add({0, 0, 0}, kNoTurn, kNoTurn, nullptr, landmarks);
  EXPECT_EQ(above.map()->landmarks.size(), 101u);
  EXPECT_GE(above.map()->bounds[1], 97.0);
  EXPECT_LE(above.map()->bounds[1], 99.0);
  landmarks.resize(1);
  above.Add({0, 0, 0}, kNoTurn, kNoTurn, nullptr, landmarks);
  EXPECT_GE(above.map()->bounds[1], 97.0);  // the view never becomes smaller
}

}  // namespace
}  // namespace alidade
