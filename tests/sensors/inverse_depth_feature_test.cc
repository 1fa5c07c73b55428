// SPDX-License-Identifier: Apache-2.0
#include "sensors/inverse_depth_feature.h"

#include <gtest/gtest.h>

#include "support/landmarks.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

const Vec3 kAnchor{-0.5, 0.2, -0.8};

template <class Representation>
SharedSensor InverseDepthSensor(const Camera& camera) {
  return MakeSensor(InverseDepthFeature<Representation>(camera, 1.5), "inverse_depth_feature");
}

/// Returns a landmark 4 m away from the camera at kPose, which sees the landmark at `pixel`. The
/// anchor is kAnchor.
template <class Representation>
Blocks SeenAt(const Camera& camera, const std::vector<double>& pixel) {
  Vec3 h;
  double p[3];
  EXPECT_TRUE(camera.Unproject(pixel.data(), h.data()));
  EXPECT_TRUE(PlaceLandmark<Xyz>(kPose[0].data(), kPose[1].data(), h.data(), 0.25, p));
  return LandmarkAt<Representation>(kAnchor, {p[0], p[1], p[2]});
}

TEST(InverseDepthFeature, PredictsWorkedNumbers) {
  // The camera at (1, 0, 0) m looks along z, and the point is at (0, 0.4, 2) m, so h = (-1, 0.4, 2)
  // m.
  // u = 320 + 525 (-1) / 2 = 57.5 px, v = 240 + 525 * 0.4 / 2 = 345 px
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const Blocks landmark = LandmarkAt<Representation>({0.3, -0.2, 0.1}, {0.0, 0.4, 2.0});
    const Blocks roles = Blocks{{1, 0, 0}, {1, 0, 0, 0}} + landmark;
    const SharedSensor sensor = InverseDepthSensor<Representation>(Pinhole());
    const std::vector<double> z = Predicted(sensor, roles);
    EXPECT_NEAR(z[0], 57.5, 1e-12);
    EXPECT_NEAR(z[1], 345.0, 1e-12);
    double l[4] = {kPoison, kPoison, kPoison, kPoison};
    ASSERT_EQ(sensor->SqrtNoise(Pointers(roles).data(), z.data(), l), Status::kOk);
    EXPECT_EQ(std::vector<double>(l, l + 4), (std::vector<double>{1.5, 0, 0, 1.5}));
  });
}

TEST(InverseDepthFeature, HasTrueJacobiansOverTheImage) {
  const Camera camera = Lens();
  ForEachRepresentation([&](auto representation) {
    using Representation = decltype(representation);
    for (const std::vector<double>& pixel :
         {std::vector<double>{320.5, 239.25}, {-0.5, -0.5}, {639.5, 12.0}, {5.0, 479.5}}) {
      const Blocks roles = kPose + SeenAt<Representation>(camera, pixel);
      const std::vector<double> z = Predicted(InverseDepthSensor<Representation>(camera), roles);
      EXPECT_NEAR(z[0], pixel[0], 1e-9);
      EXPECT_NEAR(z[1], pixel[1], 1e-9);
      ExpectTrueJacobians(InverseDepthSensor<Representation>(camera), roles);
    }
  });
}

TEST(InverseDepthFeature, SeesAtInfinityAndBeyond) {
  for (const double rho : {0.0, 1e-9, -0.01}) {
    const Blocks pose{{0.1, 0, 0}, {1, 0, 0, 0}};
    const Ray<double> ray{{0, 0, 0}, {0.0, 0.6, 0.8}, rho};
    const SharedSensor angles = InverseDepthSensor<InverseDepth>(Pinhole());
    const SharedSensor anchored = InverseDepthSensor<Anchored>(Pinhole());
    const Blocks a = pose + LandmarkOn<InverseDepth>(ray), b = pose + LandmarkOn<Anchored>(ray);
    ExpectTrueJacobians(angles, a);
    ExpectTrueJacobians(anchored, b);
    EXPECT_NEAR(Predicted(angles, a)[0], 320.0 - 525.0 * rho * 0.1 / 0.8, 1e-12);
    EXPECT_NEAR(Predicted(anchored, b)[1], 240.0 + 525.0 * 0.75, 1e-12);
  }
}

TEST(InverseDepthFeature, SeesNearThePoles) {
  // phi = 90 deg - 1e-6 rad: the ray is almost parallel to -y. The camera looks along -y.
  const double half = std::sqrt(0.5);
  const Blocks pose{{0, 0, 0}, {half, half, 0, 0}};
  const double phi = 1.5707963267948966 - 1e-6;
  const Blocks roles = pose + Blocks{{0, 0, 0, 0.7, phi, 0.2}};
  const SharedSensor sensor = InverseDepthSensor<InverseDepth>(Pinhole());
  ExpectTrueJacobians(sensor, roles);
  const std::vector<double> z = Predicted(sensor, roles);
  EXPECT_NEAR(z[0], 320.0 + 525.0 * 1e-6 * std::sin(0.7), 1e-9);
  EXPECT_NEAR(z[1], 240.0 + 525.0 * 1e-6 * std::cos(0.7), 1e-9);
}

TEST(InverseDepthFeature, InitialisesFromAPrior) {
  for (const Camera& camera : {Pinhole(), Lens()}) {
    ForEachRepresentation([&](auto representation) {
      ExpectTrueInverse(InverseDepthSensor<decltype(representation)>(camera),
                        Blocks{kPose[0], kPose[1], {411.0, 87.5}, {0.25}});
    });
  }
  const SharedSensor sensor = InverseDepthSensor<InverseDepth>(Pinhole());
  const double pixel[2] = {411.0, 87.5};
  double y[6];
  std::vector<const double*> roles{kPose[0].data(), kPose[1].data(), nullptr};
  EXPECT_EQ(sensor->Initialise(roles.data(), {pixel}, nullptr, {.y = y}), Status::kInvalid);
}

TEST(InverseDepthFeature, IsUndefinedBehindTheCamera) {
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const Blocks roles =
        Blocks{{0, 0, 3}, {1, 0, 0, 0}} + LandmarkAt<Representation>({0, 0, 0}, {0.1, 0.2, 2.0});
    double z[2] = {kPoison, kPoison};
    EXPECT_EQ(InverseDepthSensor<Representation>(Pinhole())->Predict(Pointers(roles).data(), z),
              Status::kOutOfDomain);
    EXPECT_EQ(z[0], kPoison);
    EXPECT_EQ(z[1], kPoison);
  });
}

TEST(InverseDepthFeature, IsValidOnTheImage) {
  const SharedSensor sensor = InverseDepthSensor<Xyz>(Pinhole());
  const double on[2] = {639.4, -0.4}, beside[2] = {639.6, 10.0}, none[2] = {kNaN, 10.0};
  EXPECT_EQ(sensor->Valid({on}), Status::kOk);
  EXPECT_EQ(sensor->Valid({beside}), Status::kInvalid);
  EXPECT_EQ(sensor->Valid({none}), Status::kInvalid);
}

TEST(InverseDepthFeature, DescribesItsLandmark) {
  const SharedSensor anchored = InverseDepthSensor<Anchored>(Pinhole());
  EXPECT_TRUE(anchored->has_landmark());
  EXPECT_EQ(anchored->inverse().role, 2);
  EXPECT_EQ(anchored->inverse().count, 3);
  EXPECT_EQ(anchored->inverse().prior_size, 1);
  EXPECT_NE(anchored->roles()[2].flags & ALIDADE_ROLE_SHARED, 0u);
  const SharedSensor angles = InverseDepthSensor<InverseDepth>(Pinhole());
  EXPECT_EQ(angles->inverse().count, 1);
  EXPECT_FALSE(angles->roles()[1].landmark());
  EXPECT_EQ(angles->roles()[2].elements.back(), "rho");
}

TEST(InverseDepthFeature, MayHaveAnotherNoiseInUThanInV) {
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const SharedSensor sensor = MakeSensor(
        InverseDepthFeature<Representation>(Pinhole(), std::array{1.5, 0.25}), "feature");
    const Blocks roles = kPose + SeenAt<Representation>(Pinhole(), {100, 200});
    double z[2], l[4] = {kPoison, kPoison, kPoison, kPoison};
    ASSERT_EQ(sensor->SqrtNoise(Pointers(roles).data(), z, l), Status::kOk);
    EXPECT_EQ(std::vector<double>(l, l + 4), (std::vector<double>{1.5, 0, 0, 0.25}));
  });
}

}  // namespace
}  // namespace alidade
