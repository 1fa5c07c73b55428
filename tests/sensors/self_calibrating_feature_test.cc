// SPDX-License-Identifier: Apache-2.0
#include "sensors/self_calibrating_feature.h"

#include <gtest/gtest.h>

#include "alidade/estimation/direct_models.h"
#include "alidade/model/camera.h"
#include "support/landmarks.h"
#include "support/model_checks.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

template <class Lens>
SharedSensor Made() {
  return MakeSensor(SelfCalibratingFeature<Lens>(0.5), "self_calibrating_feature");
}

/// The camera has a general pose, and the point is 5 m in front of it.
const Blocks kRadial{{0.4, -1.1, 0.3}, {0.8, 0.2, -0.4, 0.4}, {500, -0.3, 0.2}, {-2.6, 1.1, 3.5}};
const std::vector<double> kRadtan{500, 320, 240, -0.3, 0.2, 0.05, 0.01, -0.02};

// With h = (0.3, -0.4, 1) m, q = 0.25, s = 1 - 0.3 * 0.25 + 0.2 * 0.0625 = 0.9375 and
// f s = 468.75 px.
TEST(SelfCalibratingFeature, PredictsWorkedNumbers) {
  const Blocks roles{{1, 0, 0}, {1, 0, 0, 0}, {500, -0.3, 0.2}, {1.3, -0.4, 1}};
  const std::vector<double> z = Predicted(Made<RadialLens>(), roles);
  EXPECT_NEAR(z[0], 140.625, 1e-12);
  EXPECT_NEAR(z[1], -187.5, 1e-12);
  std::vector<double> l(4, kPoison);
  ASSERT_EQ(Made<RadialLens>()->SqrtNoise(Pointers(roles).data(), z.data(), l.data()), Status::kOk);
  EXPECT_EQ(l, (std::vector<double>{0.5, 0, 0, 0.5}));
}

TEST(SelfCalibratingFeature, MayHaveAnotherNoiseInUThanInV) {
  const SharedSensor sensor = MakeSensor(SelfCalibratingFeature<RadialLens>(std::array{0.5, 2.0}),
                                         "self_calibrating_feature");
  std::vector<double> z(2), l(4, kPoison);
  ASSERT_EQ(sensor->SqrtNoise(Pointers(kRadial).data(), z.data(), l.data()), Status::kOk);
  EXPECT_EQ(l, (std::vector<double>{0.5, 0, 0, 2.0}));
}

/// Compares the model with the equation of BAL: P = R X + t, p = -P / P.z. The camera of BAL looks
/// along -z, and its y axis points up.
TEST(SelfCalibratingFeature, IsTheCameraOfBalTurnedAboutItsXAxis) {
  const double turn[4] = {0, 1, 0, 0};
  double q[4], back[4], along[3], p[3];
  UnitQuaternion::Multiply(kRadial[1].data(), turn,
                           q);  // world_from_cam for the camera axes of BAL
  for (int i = 0; i < 4; ++i) back[i] = i == 0 ? q[i] : -q[i];
  for (std::size_t i = 0; i < 3; ++i) along[i] = kRadial[3][i] - kRadial[0][i];
  UnitQuaternion::Rotate(back, along, p);
  const double x = -p[0] / p[2], y = -p[1] / p[2], r2 = x * x + y * y;
  const double scale = 500 * (1 - 0.3 * r2 + 0.2 * r2 * r2);
  const std::vector<double> z = Predicted(Made<RadialLens>(), kRadial);
  EXPECT_NEAR(z[0], scale * x, 1e-10);
  EXPECT_NEAR(z[1], -scale * y, 1e-10);
}

TEST(SelfCalibratingFeature, IsTheRadtanLensOfTheOtherSensors) {
  const Camera camera(640, 480, 500, 500, 320, 240, CameraModel::kRadtan, {-0.3, 0.2, 0.05, 0},
                      {0.01, -0.02});
  double along[3], h[3], pixel[2];
  for (std::size_t i = 0; i < 3; ++i) along[i] = kRadial[3][i] - kRadial[0][i];
  UnitQuaternion::RotateBack(kRadial[1].data(), along, h);
  ASSERT_TRUE(camera.Project(h, pixel));
  const std::vector<double> z =
      Predicted(Made<RadtanLens>(), {kRadial[0], kRadial[1], kRadtan, kRadial[3]});
  EXPECT_NEAR(z[0], pixel[0], 1e-10);
  EXPECT_NEAR(z[1], pixel[1], 1e-10);
}

const std::vector<double> kOpenCv{500, 510, 320, 240, -0.3, 0.2, 0.01, -0.02};

TEST(SelfCalibratingFeature, IsTheCameraOfOpenCvWithTwoFocalLengths) {
  const Camera camera(640, 480, 500, 510, 320, 240, CameraModel::kRadtan, {-0.3, 0.2, 0, 0},
                      {0.01, -0.02});
  double along[3], h[3], pixel[2];
  for (std::size_t i = 0; i < 3; ++i) along[i] = kRadial[3][i] - kRadial[0][i];
  UnitQuaternion::RotateBack(kRadial[1].data(), along, h);
  ASSERT_TRUE(camera.Project(h, pixel));
  const std::vector<double> z =
      Predicted(Made<OpenCvLens>(), {kRadial[0], kRadial[1], kOpenCv, kRadial[3]});
  EXPECT_NEAR(z[0], pixel[0], 1e-10);
  EXPECT_NEAR(z[1], pixel[1], 1e-10);
}

template <class Lens>
void ExpectTrueLensJacobian(const Blocks& roles) {
  ExpectSame(SensorJacobian(Made<Lens>(), roles), NumericSensorJacobian(Made<Lens>(), roles), 1e-8);
}
TEST(SelfCalibratingFeature, HasTrueJacobians) {
  ExpectTrueLensJacobian<RadialLens>(kRadial);
  ExpectTrueLensJacobian<RadtanLens>({kRadial[0], kRadial[1], kRadtan, kRadial[3]});
  ExpectTrueLensJacobian<OpenCvLens>({kRadial[0], kRadial[1], kOpenCv, kRadial[3]});
}

TEST(SelfCalibratingFeature, SeesNothingBehindIt) {
  Blocks roles{{0, 0, 0}, {1, 0, 0, 0}, {500, 0, 0}, {0.1, 0.1, 0.0}};
  std::vector<double> z(2, kPoison);
  for (const double depth : {0.0, -1.0, kNaN}) {
    roles[3][2] = depth;
    EXPECT_EQ(Made<RadialLens>()->Predict(Pointers(roles).data(), z.data()), Status::kOutOfDomain);
    EXPECT_EQ(z[0], kPoison);
  }
}

/// The equation of BAL also holds for points behind the camera (P.z > 0). The image of such a point
/// is the image of the mirrored point.
TEST(SelfCalibratingFeature, SeesPointsBehindItWhereItsDomainIsProjective) {
  const SharedSensor sensor =
      MakeSensor(SelfCalibratingFeature<RadialLens>(0.5, true), "self_calibrating_feature");
  // h = (-0.3, 0.4, -1) m is the opposite of h in PredictsWorkedNumbers. Both points lie on one
  // line through the camera, so x = h / hz is the same for both.
  Blocks roles{{1, 0, 0}, {1, 0, 0, 0}, {500, -0.3, 0.2}, {0.7, 0.4, -1}};
  const std::vector<double> z = Predicted(sensor, roles);
  EXPECT_NEAR(z[0], 140.625, 1e-12);
  EXPECT_NEAR(z[1], -187.5, 1e-12);
  ExpectSame(SensorJacobian(sensor, roles), NumericSensorJacobian(sensor, roles), 1e-8);
  std::vector<double> untouched(2, kPoison);
  for (const double depth : {0.0, kNaN}) {
    roles[3][2] = depth;
    EXPECT_EQ(sensor->Predict(Pointers(roles).data(), untouched.data()), Status::kOutOfDomain);
    EXPECT_EQ(untouched[0], kPoison);
  }
}

}  // namespace
}  // namespace alidade
