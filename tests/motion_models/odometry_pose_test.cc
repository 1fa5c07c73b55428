// SPDX-License-Identifier: Apache-2.0
#include "motion_models/odometry_pose.h"

#include <gtest/gtest.h>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::MapHost;
using testing::StepResult;

const double kPi = 3.14159265358979323846;

// The x axis of the vehicle points forward and its z axis points up. The camera looks forward:
// x_cam = -y, y_cam = -z, z_cam = x. The camera is 1 m in front of the vehicle's origin and 1.5 m
// above it.
const MapHost::Values kMounted{{"noise.kind", {1}},  // selects discrete noise
                               {"noise.linear_velocity", {0.03, 0.3, 0.3}},
                               {"noise.angular_velocity", {0.002}},
                               {"vehicle_from_cam.position", {1, 0, 1.5}},
                               {"vehicle_from_cam.orientation.w", {0.5}},
                               {"vehicle_from_cam.orientation.x", {-0.5}},
                               {"vehicle_from_cam.orientation.y", {0.5}},
                               {"vehicle_from_cam.orientation.z", {-0.5}}};

/// Model parameter states that leave the extrinsics and the speed of the input unchanged.
const Blocks kAsGiven{{0, 0, 0}, {1, 0, 0, 0}, {0}};

/// Returns the camera pose of a vehicle at (x, y) with the heading `yaw`.
Blocks Camera(double x, double y, double yaw) {
  const double mount[3] = {1, 0, 1.5}, camera[4] = {0.5, -0.5, 0.5, -0.5};
  const double turn[4] = {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
  Blocks pose{std::vector<double>(3), std::vector<double>(4)};
  UnitQuaternion::Rotate(turn, mount, pose[0].data());
  pose[0][0] += x;
  pose[0][1] += y;
  UnitQuaternion::Multiply(turn, camera, pose[1].data());
  pose.insert(pose.end(), kAsGiven.begin(), kAsGiven.end());
  return pose;
}

void ExpectPose(const Blocks& a, const Blocks& b) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[0][i], b[0][i], 1e-14);
  double d[3];
  UnitQuaternion::Minus(a[1].data(), b[1].data(), d);
  for (const double element : d) EXPECT_NEAR(element, 0.0, 1e-14);
}

TEST(OdometryPose, FollowsTheVehicle) {
  const auto motion = AbiMotion<OdometryPose>(kMounted);
  ASSERT_TRUE(motion->has_input());
  // The vehicle moves forward at 2 m/s for 3 s.
  const double straight[6] = {2, 0, 0, 0, 0, 0};
  ExpectPose(testing::StepWithJacobians(motion, Camera(5, 6, 0), straight, nullptr, 3.0).next,
             Camera(11, 6, 0));
  // The vehicle turns left on a quarter circle of radius 4 m in 1 s.
  const double bend[6] = {2 * kPi, 0, 0, 0, 0, kPi / 2};
  ExpectPose(testing::StepWithJacobians(motion, Camera(5, 6, 0), bend, nullptr, 1.0).next,
             Camera(9, 10, kPi / 2));
  // The vehicle moves 0.005 rad along a circle of radius 400 m. For such a small angle the model
  // uses series.
  const double all_but_straight[6] = {2, 0, 0, 0, 0, 0.005};
  const double half = std::sin(0.0025);
  ExpectPose(
      testing::StepWithJacobians(motion, Camera(0, 0, 0), all_but_straight, nullptr, 1.0).next,
      Camera(400 * std::sin(0.005), 800 * half * half, 0.005));
  // The vehicle starts at another heading. The control input is zero, and only the noise moves the
  // vehicle.
  const double none[6] = {};
  ExpectPose(testing::StepWithJacobians(motion, Camera(5, 6, kPi / 2), none, bend, 1.0).next,
             Camera(1, 10, kPi));
}

// Model parameter states must have the same effect as the same values in the config and in the
// input.
TEST(OdometryPose, MountingAndSpeedMayBeInTheState) {
  const double input[6] = {2, 0.1, -0.3, 0.2, 0.5, -0.9};
  const double wrong[6] = {2 / 1.25, 0.1 / 1.25, -0.3 / 1.25, 0.2, 0.5, -0.9};
  const Blocks truth = testing::StepWithJacobians(AbiMotion<OdometryPose>(kMounted),
                                                  Camera(5, 6, 1), input, nullptr, 0.7)
                           .next;

  MapHost::Values not_mounted = kMounted;  // mounted 0.5 m lower and rotated by 0.1 rad
  not_mounted["vehicle_from_cam.position"] = {1, 0, 1};
  const double tilt[4] = {std::cos(0.05), 0, std::sin(0.05), 0},
               back[4] = {tilt[0], 0, -tilt[2], 0};
  const double camera[4] = {0.5, -0.5, 0.5, -0.5};
  double turned[4];
  UnitQuaternion::Multiply(back, camera, turned);
  const char* const parts[] = {"w", "x", "y", "z"};
  for (std::size_t i = 0; i < 4; ++i) {
    not_mounted[std::string("vehicle_from_cam.orientation.") + parts[i]] = {turned[i]};
  }
  Blocks x = Camera(5, 6, 1);
  x[2] = {0, 0, 0.5};
  x[3].assign(tilt, tilt + 4);
  x[4] = {0.25};
  const Blocks next =
      testing::StepWithJacobians(AbiMotion<OdometryPose>(not_mounted), x, wrong, nullptr, 0.7).next;
  ExpectPose(next, truth);
  for (std::size_t i = 2; i < 5; ++i)
    EXPECT_EQ(next[i], x[i]);  // the model parameter states are constant
}

TEST(OdometryPose, HasTrueJacobiansAlsoWithoutTurning) {
  const auto motion = AbiMotion<OdometryPose>(kMounted);
  const Blocks x{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {0.1, -0.2, 0.3}, {0.8, -0.4, 0.2, 0.4}, {0.1}};
  const std::vector<double> none(6), w{0.3, -0.2, 0.5, 0.4, 0.1, -0.6};
  const double turning[6] = {2, 0.1, -0.3, 0.2, 0.5, -0.9}, straight[6] = {2, 0.1, -0.3, 0, 0, 0};
  testing::ExpectTrueJacobians(motion, x, turning, w, 0.2);
  testing::ExpectTrueJacobians(motion, x, straight, none, 0.2);
}

TEST(OdometryPose, NoiseIsPerAxis) {
  const auto motion = AbiMotion<OdometryPose>(kMounted);
  const std::vector<double> q = testing::Covariance(motion, Camera(0, 0, 0), 0.1);
  const double sigma[6] = {0.03, 0.3, 0.3, 0.002, 0.002, 0.002};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(q[7 * i], sigma[i] * sigma[i], 1e-17);
}

// The velocity error is either constant over the gap or white noise. On a straight path, processing
// the gap in two parts changes only the lateral effect of rotation.
TEST(OdometryPose, NoiseOfEitherKindIsThatOfTheWholeGap) {
  MapHost::Values values = kMounted;
  values["noise.kind"] = {0};
  const auto held = AbiMotion<OdometryPose>(kMounted), adds = AbiMotion<OdometryPose>(values);
  EXPECT_TRUE(held->discrete_noise());
  EXPECT_FALSE(adds->discrete_noise());
  const double still[6] = {}, straight[6] = {2, 0, 0, 0, 0, 0}, turning[6] = {2, 0, 0, 0, 0, 0.5};
  for (const auto& motion : {held, adds}) {
    EXPECT_LT(testing::DefectOfParts(motion, Camera(5, 6, 1), still, 0.03, 0.07), 1e-14);
    EXPECT_LT(testing::DefectOfParts(motion, Camera(5, 6, 1), straight, 0.5e-3, 0.5e-3), 1e-5);
    EXPECT_LT(testing::DefectOfParts(motion, Camera(5, 6, 1), turning, 0.5e-3, 0.5e-3), 1e-3);
  }
  const std::vector<double> q = testing::Covariance(adds, Camera(0, 0, 0), 0.1);
  EXPECT_NEAR(q[0], 0.03 * 0.03 / 0.1, 1e-17);
}

TEST(OdometryPose, IsMountedByAUnitQuaternion) {
  MapHost::Values values = kMounted;
  values["vehicle_from_cam.orientation.w"] = {0.51};
  const MapHost host(values);
  static_cast<void>(testing::MakeInstance(&EmplaceMotion<OdometryPose>, host));
  ASSERT_EQ(host.failures().size(), 1u);
  EXPECT_EQ(host.failures()[0],
            "vehicle_from_cam.orientation: does not have unit length (tolerance 1e-3)");
}

}  // namespace
}  // namespace alidade
