// SPDX-License-Identifier: Apache-2.0
#include "sensors/known_pixel.h"

#include <gtest/gtest.h>

#include "alidade/model/fixed_known.h"
#include "support/sensor_checks.h"

namespace alidade {
namespace {

using namespace testing;

Camera Lens() { return {640, 480, 400, 410, 320, 240}; }

// The body is at the origin, without rotation. The camera is 1 m to its right (x of the body). Its
// axes are those of the body: x right, y down, z ahead.
TEST(KnownPixel, ProjectsThePoint) {
  const SharedSensor sensor = MakeSensor(KnownPixel(Lens(), {1, 2}), "known_pixel");
  const Blocks roles{{0, 0, 0}, kNeutral, {1, 0, 0}, kNeutral};
  const double point[3] = {2, 0.5, 5};
  ExpectSame(Prediction(sensor, roles, point), {320 + 400 * 0.2, 240 + 410 * 0.1}, 1e-15);
  EXPECT_EQ(NoiseDiagonal(sensor, roles, point), (std::vector<double>{1, 2}));
}

TEST(KnownPixel, HasTheSameValueForAFixedPoint) {
  const Eigen::Vector3d p(0.1, -0.2, 0.3), arm(0.1, 0.2, -0.1);
  const std::vector<double> mounting{0.99, 0.1, 0.1, -0.01};
  std::vector<double> unit = mounting;
  Geometry::UnitQuaternion().Normalise(unit.data());
  const Eigen::Matrix3d r = RotationMatrix(kAttitude), b = RotationMatrix(unit);
  const Eigen::Vector3d in_cam(0.4, -0.3, 4), point = p + r * (arm + b * in_cam);
  const SharedSensor sensor = MakeSensor(
      FixedKnown<KnownPixel>(KnownPixel(Lens(), {1, 2}), {point[0], point[1], point[2]}), "pixel");
  const Blocks roles{Elements(p), kAttitude, Elements(arm), unit};
  ExpectSame(Prediction(sensor, roles), {320 + 400 * 0.1, 240 - 410 * 0.075}, 1e-14);
  ExpectTrueJacobian(sensor, roles);
  const double inside[2] = {639, 0}, outside[2] = {640, 0};
  EXPECT_EQ(sensor->Valid({inside}), Status::kOk);
  EXPECT_EQ(sensor->Valid({outside}), Status::kInvalid);
}

TEST(KnownPixel, IsNotDefinedBehindTheCamera) {
  const double point[3] = {0, 0, -1};
  ExpectOutOfDomain(MakeSensor(KnownPixel(Lens(), {1, 2}), "pixel"),
                    {{0, 0, 0}, kNeutral, {0, 0, 0}, kNeutral}, point);
}

}  // namespace
}  // namespace alidade
