// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/landmark.h"

#include <gtest/gtest.h>

#include "support/landmarks.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::ForEachRepresentation;
using testing::kNumeric;
using testing::LandmarkAt;
using testing::Pointers;
using testing::Vec3;

constexpr double kPi = 3.14159265358979323846;

// The camera is at kPosition with the orientation kTurn. The point is 4 m away from the camera.
const Vec3 kPosition{0.4, -1.1, 0.3};
const std::array<double, 4> kTurn{0.8, 0.2, -0.4, 0.4};
const Vec3 kPoint{1.4, 0.9, 3.6};

Vec3 HOf(const Ray<double>& ray, const Vec3& position = kPosition) {
  Vec3 h;
  InCamera(ray, position.data(), kTurn.data(), h.data());
  return h;
}

template <class Representation>
Ray<double> RayOf(const Blocks& blocks) {
  return alidade::RayOf<Representation>(Pointers(blocks).data());
}

TEST(Landmark, InverseDepthHasTheAnglesOfMonoSlam) {
  // theta = 90 deg and phi = 30 deg, so m = (cos 30, -sin 30, 0).
  const double y[6] = {1, 2, 3, kPi / 2, kPi / 6, 0.25};
  const Ray<double> ray = InverseDepth::ToRay(y);
  EXPECT_NEAR(ray.direction[0], std::sqrt(3.0) / 2, 1e-15);
  EXPECT_NEAR(ray.direction[1], -0.5, 1e-15);
  EXPECT_NEAR(ray.direction[2], 0.0, 1e-15);
  // The point is 4 m away from the anchor.
  double p[3];
  ASSERT_TRUE(Xyz::FromRay(ray, p));
  EXPECT_NEAR(p[0], 1 + 2 * std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(p[1], 0.0, 1e-14);
  EXPECT_NEAR(p[2], 3.0, 1e-14);
}

TEST(Landmark, AllFormsAreSeenAlike) {
  Vec3 along, seen;  // seen = R_CW (p - r)
  for (std::size_t i = 0; i < 3; ++i) along[i] = kPoint[i] - kPosition[i];
  UnitQuaternion::RotateBack(kTurn.data(), along.data(), seen.data());
  const Vec3 anchor{-0.5, 0.2, -0.8};
  ForEachRepresentation([&](auto representation) {
    const Ray<double> ray =
        RayOf<decltype(representation)>(LandmarkAt<decltype(representation)>(anchor, kPoint));
    const Vec3 h = HOf(ray);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(h[i] / ray.rho, seen[i], 1e-14);
  });
}

TEST(Landmark, IsSeenAtInfinityTheSameFromEverywhere) {
  const double y[6] = {1, 2, 3, 0.4, -0.3, 0.0};
  const Ray<double> ray = InverseDepth::ToRay(y);
  const Vec3 here = HOf(ray), there = HOf(ray, {50, -70, 90});
  EXPECT_EQ(here, there);
  double p[3];
  EXPECT_FALSE(Xyz::FromRay(ray, p));
}

TEST(Landmark, IsPlacedWhereItIsSeen) {
  const Vec3 h{0.3, -0.2, 1.7};  // h does not have unit length
  ForEachRepresentation([&](auto representation) {
    using Representation = decltype(representation);
    double y[detail::Blocks<Representation>::kAmbient], p[3];
    ASSERT_TRUE(PlaceLandmark<Representation>(kPosition.data(), kTurn.data(), h.data(), 0.25, y));
    ASSERT_TRUE(Xyz::FromRay(Representation::ToRay(y), p));
    Vec3 along, seen;
    for (std::size_t i = 0; i < 3; ++i) along[i] = p[i] - kPosition[i];
    UnitQuaternion::RotateBack(kTurn.data(), along.data(), seen.data());
    const double scale =
        4.0 / std::sqrt(0.09 + 0.04 + 1.7 * 1.7);  // The point is 4 m away in the direction of h.
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], scale * h[i], 1e-14);
  });
}

TEST(Landmark, IsNotPlacedWhereTheFormHasNoValue) {
  const Vec3 down{0, 1, 0};
  const std::array<double, 4> straight{1, 0, 0, 0};
  double y[7] = {7, 7, 7, 7, 7, 7, 7};
  EXPECT_FALSE(PlaceLandmark<InverseDepth>(kPosition.data(), straight.data(), down.data(), 0.5, y));
  EXPECT_FALSE(PlaceLandmark<Xyz>(kPosition.data(), straight.data(), down.data(), 0.0, y));
  EXPECT_EQ(y[0], 7);
  EXPECT_TRUE(PlaceLandmark<Anchored>(kPosition.data(), straight.data(), down.data(), 0.0, y));
}

TEST(Landmark, ConversionToXyzHasTrueJacobians) {
  const Vec3 anchor{-0.5, 0.2, -0.8};
  Space xyz;
  xyz.geometry = Geometry::Vector(3);
  ForEachRepresentation([&](auto representation) {
    using Representation = decltype(representation);
    const Blocks blocks = LandmarkAt<Representation>(anchor, kPoint);
    constexpr int n = detail::Blocks<Representation>::kTangent;
    double p[3], j[3 * n];
    ASSERT_EQ(ConvertToXyz<Representation>(Pointers(blocks).data(), p, {j, n}), Status::kOk);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(p[i], kPoint[i], 1e-14);
    std::vector<Space> spaces;
    const auto add = [&](auto index) {
      using G = detail::SpaceAt<decltype(index)::value, Representation>;
      spaces.emplace_back();
      spaces.back().geometry = Geometry::Of<G>();
    };
    detail::ForEach(add, typename detail::Blocks<Representation>::Indices{});
    const auto convert = [](const Blocks& x) {
      Blocks point{std::vector<double>(3)};
      EXPECT_EQ(ConvertToXyz<Representation>(Pointers(x).data(), point[0].data()), Status::kOk);
      return point;
    };
    testing::ExpectSame(std::vector<double>(j, j + 3 * n),
                        testing::NumericJacobian(spaces, blocks, {xyz}, convert), 10 * kNumeric);
  });
}

// Tests faults 40 and 83 of tests/faults/README.md.
TEST(Landmark, IsNotConvertedAtInfinityOrBehindIt) {
  for (const double rho : {0.0, -0.1}) {
    const Blocks blocks{{0, 0, 0, 0.1, 0.2, rho}};
    double p[3] = {7, 7, 7};
    EXPECT_EQ(ConvertToXyz<InverseDepth>(Pointers(blocks).data(), p), Status::kOutOfDomain);
    EXPECT_EQ(p[0], 7);
  }
}

TEST(Landmark, LinearityIndexIsThatOfCivera) {
  // The anchor is at the origin, the point is 4 m ahead, and the camera is 3 m to the side. So d1 =
  // 5 m, cos alpha = 0.8, sigma_d = 0.02 / 0.25^2 = 0.32 m, and
  // L_d = 4 * 0.32 / 5 * 0.8 = 0.2048.
  const double y[6] = {0, 0, 0, 0, 0, 0.25};
  const double beside[3] = {3, 0, 0};
  EXPECT_NEAR(LinearityIndex(InverseDepth::ToRay(y), 0.02, beside), 0.2048, 1e-15);
  const double infinite[6] = {0, 0, 0, 0, 0, 0};
  EXPECT_EQ(LinearityIndex(InverseDepth::ToRay(infinite), 0.02, beside),
            std::numeric_limits<double>::infinity());
  EXPECT_EQ(LinearityIndex(Xyz::ToRay(y), 0.02, beside), 0.0);
}

}  // namespace
}  // namespace alidade
