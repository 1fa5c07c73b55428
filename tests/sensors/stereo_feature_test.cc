// SPDX-License-Identifier: Apache-2.0
#include "sensors/stereo_feature.h"

#include <gtest/gtest.h>

#include "support/landmarks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

template <class Representation>
SharedSensor MadeStereo() {
  return MakeSensor(StereoFeature<Representation>(Pinhole(), 0.1, 0.5), "stereo_feature");
}

TEST(StereoFeature, PredictsWorkedNumbers) {
  // The left camera at (1, 0, 0) m looks along z. The point is at (0, 0.4, 2) m. The left pixel is
  // that of a single camera. d = 525 * 0.1 / 2 = 26.25 px, so u_right = 57.5 px - 26.25 px.
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const Blocks roles = Blocks{{1, 0, 0}, {1, 0, 0, 0}} +
                         LandmarkAt<Representation>({0.3, -0.2, 0.1}, {0.0, 0.4, 2.0});
    const std::vector<double> z = Predicted(MadeStereo<Representation>(), roles);
    const double expected[4] = {57.5, 345.0, 31.25, 345.0};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(z[i], expected[i], 1e-12);
    std::vector<double> l(16, kPoison);
    ASSERT_EQ(MadeStereo<Representation>()->SqrtNoise(Pointers(roles).data(), z.data(), l.data()),
              Status::kOk);
    for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(l[i], i % 5 == 0 ? 0.5 : 0.0);
  });
}

TEST(StereoFeature, MayHaveAnotherNoiseInUThanInV) {
  ForEachRepresentation([](auto representation) {
    using Representation = decltype(representation);
    const SharedSensor sensor = MakeSensor(
        StereoFeature<Representation>(Pinhole(), 0.1, std::array{0.5, 2.0}), "stereo_feature");
    const Blocks roles = kPose + LandmarkAt<Representation>({0.3, -0.2, 0.1}, {0.0, 0.4, 2.0});
    std::vector<double> z(4), l(16, kPoison);
    ASSERT_EQ(sensor->SqrtNoise(Pointers(roles).data(), z.data(), l.data()), Status::kOk);
    const double diagonal[4] = {0.5, 2.0, 0.5, 2.0};  // the order is u, v, u_right, v_right
    for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(l[i], i % 5 == 0 ? diagonal[i / 5] : 0.0);
  });
}

/// The right pixel equals the pixel of a single camera at the position of the right camera.
TEST(StereoFeature, TheRightCameraIsBesideTheLeftOne) {
  const Blocks pose{{0.4, -1.1, 0.3}, {0.8, 0.2, -0.4, 0.4}};
  const Vec3 right{0.1, 0, 0};
  Vec3 at;
  UnitQuaternion::Rotate(pose[1].data(), right.data(), at.data());
  Vec3 ahead{0.2, -0.3, 5.0}, point;  // coordinates in the left camera
  UnitQuaternion::Rotate(pose[1].data(), ahead.data(), point.data());
  for (std::size_t i = 0; i < 3; ++i) at[i] += pose[0][i], point[i] += pose[0][i];
  double h[3], pixel[2];
  InCamera(Xyz::ToRay(point.data()), at.data(), pose[1].data(), h);
  ASSERT_TRUE(Pinhole().Project(h, pixel));
  ForEachRepresentation([&](auto representation) {
    using Representation = decltype(representation);
    const Blocks roles = pose + LandmarkAt<Representation>({-0.5, 0.2, -0.8}, point);
    const std::vector<double> z = Predicted(MadeStereo<Representation>(), roles);
    EXPECT_NEAR(z[2], pixel[0], 1e-11);
    EXPECT_NEAR(z[3], pixel[1], 1e-11);
    ExpectTrueJacobians(MadeStereo<Representation>(), roles);
  });
}

TEST(StereoFeature, SeesNoDisparityAtInfinity) {
  const Blocks roles = Blocks{{3, 4, 5}, {1, 0, 0, 0}} + Blocks{{0, 0, 0, 0.1, 0.2, 0.0}};
  const std::vector<double> z = Predicted(MadeStereo<InverseDepth>(), roles);
  EXPECT_EQ(z[0], z[2]);
  ExpectTrueJacobians(MadeStereo<InverseDepth>(), roles);
}

TEST(StereoFeature, InitialisesWithoutAPrior) {
  ForEachRepresentation([](auto representation) {
    const SharedSensor sensor = MadeStereo<decltype(representation)>();
    EXPECT_EQ(sensor->inverse().prior_size, 0);
    ExpectTrueInverse(sensor,
                      Blocks{{0.4, -1.1, 0.3}, {0.8, 0.2, -0.4, 0.4}, {411, 87.5, 390, 87.5}});
    // The disparity is 0 px.
    const std::vector<double> far{411, 87.5, 411, 87.5};
    const std::vector<double> position{0, 0, 0}, orientation{1, 0, 0, 0};
    std::vector<const double*> roles(sensor->roles().size());
    roles[0] = position.data();
    roles[1] = orientation.data();
    double y[7] = {kPoison};
    EXPECT_EQ(sensor->Initialise(roles.data(), {far.data()}, nullptr, {.y = y}),
              Status::kOutOfDomain);
    EXPECT_EQ(y[0], kPoison);
  });
}

TEST(StereoFeature, IsValidWhereBothCamerasSeeIt) {
  const SharedSensor sensor = MadeStereo<Xyz>();
  const auto valid = [&](const std::vector<double>& z) { return sensor->Valid({z.data()}); };
  EXPECT_EQ(valid({100, 50, 90, 50}), Status::kOk);
  EXPECT_EQ(valid({5, 50, -5, 50}), Status::kInvalid);
  EXPECT_EQ(valid({645, 50, 630, 50}), Status::kInvalid);
  EXPECT_EQ(valid({90, 50, 90, 50}), Status::kInvalid);
}

TEST(StereoFeature, NeedsCamerasWithoutDistortion) {
  MapHost::Values values{
      {"camera.model", {0}},        {"camera.width", {640}}, {"camera.height", {480}},
      {"camera.fx", {525}},         {"camera.fy", {525}},    {"camera.cx", {320}},
      {"camera.cy", {240}},         {"camera.k1", {0.1}},    {"camera.k2", {0.0}},
      {"camera.baseline_m", {0.1}}, {"sigma_px", {1}}};
  const MapHost pinhole(values);
  static_cast<void>(MakeInstance(&EmplaceSensor<StereoFeature<Xyz>>, pinhole));
  EXPECT_TRUE(pinhole.failures().empty());
  values["camera.model"] = {3};
  const MapHost lens(values);
  static_cast<void>(MakeInstance(&EmplaceSensor<StereoFeature<Xyz>>, lens));
  ASSERT_EQ(lens.failures().size(), 1u);
  EXPECT_EQ(lens.failures()[0].substr(0, 13), "camera.model:");
}

}  // namespace
}  // namespace alidade
