// SPDX-License-Identifier: Apache-2.0
#include "sensors/depth_feature.h"

#include <gtest/gtest.h>

#include "support/landmarks.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

template <class Representation>
SharedSensor DepthSensor(const Camera& camera) {
  return MakeSensor(DepthFeature<Representation>(camera, 0.5, 0.01, 0.003), "depth_feature");
}

TEST(DepthFeature, PredictsWorkedNumbers) {
  // The camera at (1, 0, 0) m looks along z. The point is at (0, 0.4, 2) m, so its depth is 2 m and
  // sigma_d = 0.01 m + 0.003 * 2^2 m = 0.022 m.
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const Blocks roles = Blocks{{1, 0, 0}, {1, 0, 0, 0}} +
                         LandmarkAt<Representation>({0.3, -0.2, 0.1}, {0.0, 0.4, 2.0});
    const SharedSensor sensor = DepthSensor<Representation>(Pinhole());
    const std::vector<double> z = Predicted(sensor, roles);
    EXPECT_NEAR(z[0], 57.5, 1e-12);
    EXPECT_NEAR(z[1], 345.0, 1e-12);
    EXPECT_NEAR(z[2], 2.0, 1e-14);
    std::vector<double> l(9, kPoison);
    ASSERT_EQ(sensor->SqrtNoise(Pointers(roles).data(), z.data(), l.data()), Status::kOk);
    const double expected[9] = {0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.022};
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(l[i], expected[i], 1e-15);
  });
}

TEST(DepthFeature, MayHaveAnotherNoiseInUThanInV) {
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const SharedSensor sensor = MakeSensor(
        DepthFeature<Representation>(Pinhole(), std::array{0.5, 2.0}, 0.01), "depth_feature");
    const Blocks roles = Blocks{{1, 0, 0}, {1, 0, 0, 0}} +
                         LandmarkAt<Representation>({0.3, -0.2, 0.1}, {0.0, 0.4, 2.0});
    std::vector<double> z(3), l(9, kPoison);
    ASSERT_EQ(sensor->SqrtNoise(Pointers(roles).data(), z.data(), l.data()), Status::kOk);
    EXPECT_EQ(l, (std::vector<double>{0.5, 0, 0, 0, 2.0, 0, 0, 0, 0.01}));
  });
}

TEST(DepthFeature, HasTrueJacobians) {
  Vec3 ahead{0.2, -0.3, 5.0}, point;
  UnitQuaternion::Rotate(kPose[1].data(), ahead.data(), point.data());
  for (std::size_t i = 0; i < 3; ++i) point[i] += kPose[0][i];
  ForEachRepresentation([&](auto representation) {
    using Representation = decltype(representation);
    const Blocks roles = kPose + LandmarkAt<Representation>({-0.5, 0.2, -0.8}, point);
    ExpectTrueJacobians(DepthSensor<Representation>(Lens()), roles);
    EXPECT_NEAR(Predicted(DepthSensor<Representation>(Lens()), roles)[2], 5.0, 1e-14);
  });
}

TEST(DepthFeature, InitialisesWithoutAPrior) {
  ForEachRepresentation([](auto representation) {
    const SharedSensor sensor = DepthSensor<decltype(representation)>(Lens());
    EXPECT_EQ(sensor->inverse().prior_size, 0);
    ExpectTrueInverse(sensor, Blocks{kPose[0], kPose[1], {411, 87.5, 3.2}});
  });
}

TEST(DepthFeature, HasNoDepthAtInfinityOrBehind) {
  for (const double rho : {0.0, -0.1}) {
    const Blocks roles = Blocks{{0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0, 0.1, 0.2, rho}};
    double z[3] = {kPoison, kPoison, kPoison};
    EXPECT_EQ(DepthSensor<InverseDepth>(Pinhole())->Predict(Pointers(roles).data(), z),
              Status::kOutOfDomain);
    EXPECT_EQ(z[2], kPoison);
  }
}

TEST(DepthFeature, IsValidOnTheImageWithADepth) {
  const SharedSensor sensor = DepthSensor<Xyz>(Pinhole());
  const double good[3] = {10, 10, 1}, beside[3] = {-1, 10, 1}, none[3] = {10, 10, 0};
  EXPECT_EQ(sensor->Valid({good}), Status::kOk);
  EXPECT_EQ(sensor->Valid({beside}), Status::kInvalid);
  EXPECT_EQ(sensor->Valid({none}), Status::kInvalid);
}

}  // namespace
}  // namespace alidade
