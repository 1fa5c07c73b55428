// SPDX-License-Identifier: Apache-2.0
#include "motion_models/inertial.h"

#include <gtest/gtest.h>

#include "support/integration.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::MapHost;
using testing::StepWithJacobians;
using Integration = InertialIntegration;

const MapHost::Values kNoise{{"noise.gyro", {0.01, 0.02, 0.03}},
                             {"noise.accelerometer", {0.2}},
                             {"noise.gyro_bias", {0.001}},
                             {"noise.accelerometer_bias", {0.01}}};
const Blocks kState{
    {1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {1, -2, 0.5}, {0.01, -0.02, 0.03}, {0.1, 0.2, -0.1}};
const double kReading[6] = {0.5, -0.7, 0.9, 1.0, 2.0, 9.0};

/// Solution of the differential equations for constant readings: r, q and v.
using Navigation = Eigen::Matrix<double, 10, 1>;
Navigation Integrated(double dt_s) {
  double turn[4] = {}, force[3];
  for (std::size_t i = 0; i < 3; ++i) {
    turn[i + 1] = 0.5 * (kReading[i] - kState[3][i]);
    force[i] = kReading[3 + i] - kState[4][i];
  }
  Navigation start;
  start << 1, 2, 3, 0.8, 0.2, -0.4, 0.4, 1, -2, 0.5;
  return testing::RungeKutta(start, dt_s, [&](const Navigation& y) {
    Navigation change;
    change.head<3>() = y.tail<3>();
    UnitQuaternion::Multiply(y.data() + 3, turn, change.data() + 3);  // q' = q (0, omega) / 2
    UnitQuaternion::Rotate(y.data() + 3, force, change.data() + 7);
    change[9] -= 9.80665;
    return change;
  });
}

/// Largest error of position and velocity after one step.
template <Integration kIntegration>
double ErrorOf(double dt_s) {
  const Blocks next =
      StepWithJacobians(AbiMotion<Inertial<kIntegration>>(kNoise), kState, kReading, nullptr, dt_s)
          .next;
  const Navigation expected = Integrated(dt_s);
  double d[3], error = 0.0;
  UnitQuaternion::Minus(next[1].data(), expected.data() + 3, d);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(d[i], 0.0, 1e-9) << "every form integrates the turn exactly";
    error = std::max({error, std::abs(next[0][i] - expected[i]),
                      std::abs(next[2][i] - expected[static_cast<Eigen::Index>(7 + i)])});
  }
  EXPECT_EQ(next[3], kState[3]);
  EXPECT_EQ(next[4], kState[4]);
  return error;
}

TEST(Inertial, ABodyAtRestMeasuresGravity) {
  // The body is rolled by 90 deg: z of the world is y of the body.
  const double reading[6] = {0, 0, 0, 0, 9.80665, 0};
  const Blocks x{
      {0, 0, 0}, {std::sqrt(0.5), std::sqrt(0.5), 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const Blocks next =
      StepWithJacobians(AbiMotion<Inertial<>>(kNoise), x, reading, nullptr, 2.0).next;
  for (std::size_t b : {0, 2})
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(next[b][i], 0.0, 1e-14);
}

TEST(Inertial, FallsAndTurns) {
  // Without forces, a body falls 4.903325 m in the first second. On the moon, 0.81 m.
  const double none[6] = {};
  const Blocks x{{0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  EXPECT_NEAR(StepWithJacobians(AbiMotion<Inertial<>>(kNoise), x, none, nullptr, 1.0).next[0][2],
              -4.903325, 1e-14);
  MapHost::Values moon = kNoise;
  moon["gravity_m_s2"] = {0, 0, -1.62};
  EXPECT_NEAR(StepWithJacobians(AbiMotion<Inertial<>>(moon), x, none, nullptr, 1.0).next[0][2],
              -0.81, 1e-14);
}

TEST(Inertial, EachFormIsOfItsOrder) {
  EXPECT_LT(ErrorOf<Integration::kExact>(0.1), 1e-11);
  EXPECT_LT(ErrorOf<Integration::kExact>(1.5), 1e-9);
  const double euler = ErrorOf<Integration::kEuler>(0.02) / ErrorOf<Integration::kEuler>(0.01);
  EXPECT_NEAR(std::log2(euler), 2.0, 0.05);
  const double midpoint =
      ErrorOf<Integration::kMidpoint>(0.02) / ErrorOf<Integration::kMidpoint>(0.01);
  EXPECT_NEAR(std::log2(midpoint), 3.0, 0.05);
  testing::ExpectAdditive(AbiMotion<Inertial<>>(kNoise), kState, kReading, 0.4, 0.7, 1e-11);
}

TEST(Inertial, HasTrueJacobians) {
  const std::vector<double> w{0.1, -0.2, 0.3, 0.2, -0.1, 0.4, 0.1, 0.2, 0.3, 0.3, 0.2, 0.1};
  // No turn: the readings equal the biases.
  const double still[6] = {0.01, -0.02, 0.03, 1.0, 2.0, 9.0};
  for (const double* u : {kReading, still}) {
    const std::vector<double> noise = u == still ? std::vector<double>(12) : w;
    testing::ExpectTrueJacobians(AbiMotion<Inertial<>>(kNoise), kState, u, noise, 0.1);
    testing::ExpectTrueJacobians(AbiMotion<Inertial<Integration::kEuler>>(kNoise), kState, u, noise,
                                 0.1);
    testing::ExpectTrueJacobians(AbiMotion<Inertial<Integration::kMidpoint>>(kNoise), kState, u,
                                 noise, 0.1);
  }
}

TEST(Inertial, HasTheNoiseOfItsUnit) {
  // Level body with a specific force f = (2, 0, 9.80665): theta' = w_g, v' = -[f]x theta + w_f,
  // r' = v. The biases walk: theta' = -b_g, v' = -b_f.
  const double u[6] = {0, 0, 0, 2, 0, 9.80665};
  const Blocks level{{0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(15, 15), q = f;
  f.block<3, 3>(0, 6).setIdentity();
  f.block<3, 3>(6, 3) << 0, 9.80665, 0, -9.80665, 0, 2, 0, -2, 0;
  f.block<3, 3>(3, 9) = f.block<3, 3>(6, 12) = -Eigen::Matrix3d::Identity();
  q.diagonal().segment<3>(9).setConstant(1e-6);
  q.diagonal().segment<3>(12).setConstant(1e-4);
  q.diagonal().segment<3>(3) << 1e-4, 4e-4, 9e-4;
  q.diagonal().segment<3>(6).setConstant(0.04);
  const Eigen::MatrixXd expected = testing::IntegratedNoise(f, q, 0.5);
  const SharedMotion motion = AbiMotion<Inertial<>>(kNoise);
  testing::ExpectSameCovariance(testing::NoiseOfSteps(motion, level, u, 0.5, 400), expected, 1e-3);
  // The noise of orientation and velocity does not depend on the number of steps by more than the
  // coupling of both: a tilt of 0.01 rad/s^0.5 0.5^0.5 s^0.5, times gravity.
  const Eigen::MatrixXd once = testing::NoiseOfSteps(motion, level, u, 0.5, 1);
  for (int i = 3; i < 6; ++i) EXPECT_NEAR(once(i, i), expected(i, i), 1e-7);
  EXPECT_NEAR(once(8, 8), 0.04 * 0.5, 2e-3);
}

}  // namespace
}  // namespace alidade
