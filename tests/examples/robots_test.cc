// SPDX-License-Identifier: Apache-2.0
//
// Compares the examples 33 to 44 with the figures in their READMEs, which are means over the same
// seeds.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "support/example_runs.h"

namespace alidade {
namespace {

using testing::Means;

constexpr double kDeg = M_PI / 180.0;
constexpr double kMargin = 0.05;  // the figures are rounded to two or three digits

class Robots : public ::testing::Test {
 protected:
  void Run(const std::string& name, int runs, const std::string& file = "config.yaml") {
    means_ = testing::Sweep(name, {}, file, runs);
    for (const auto& [estimator, mean] : means_) EXPECT_EQ(mean.diverged, 0) << estimator;
  }
  const Means& Of(const std::string& estimator) const { return means_.at(estimator); }

  /// Expects the RMS error to be at most that of the README.
  void ExpectRms(const std::string& estimator, const std::string& block, double figure) const {
    EXPECT_LE(Of(estimator)["rmse:" + block], (1.0 + kMargin) * figure) << estimator << block;
  }
  void ExpectNees(const std::string& estimator, const std::string& entry, double figure) const {
    EXPECT_NEAR(Of(estimator)["nees.mean:" + entry], figure, kMargin * figure) << estimator;
  }
  /// Expects the 99.9 % interval of the mean NEES to contain 1.
  void ExpectConsistent(const std::string& estimator, const std::string& entry) const {
    const std::string key = "nees.mean:" + entry;
    EXPECT_NEAR(Of(estimator)[key], 1.0, 3.29 * Of(estimator).Error(key)) << estimator;
    EXPECT_LT(Of(estimator).Error(key), 0.06) << estimator;
    EXPECT_EQ(Of(estimator).lost, 0) << estimator;
  }

 private:
  std::map<std::string, Means> means_;
};

TEST_F(Robots, FormulasDescribeAllModels) {
  Run("33_formula_models", 200);
  ExpectRms("ekf", "robot.p", 0.214);
  ExpectRms("ekf", "robot.heading", 1.54 * kDeg);
  ExpectRms("rts", "robot.p", 0.120);
  ExpectNees("ekf", "robot", 0.944);
  ExpectNees("ukf", "robot", 0.943);
  ExpectNees("rts", "robot", 0.974);
}

TEST_F(Robots, AnInvariantErrorIsConsistentForAPoorHeading) {
  Run("34_invariant_error", 100);
  ExpectRms("ekf", "body.position", 0.776);
  ExpectRms("invariant", "body.position", 0.746);
  ExpectRms("invariant", "body.velocity", 0.560);
  ExpectNees("ekf", "body", 1.64);
  ExpectNees("invariant", "body", 1.07);
  ExpectConsistent("invariant", "body");
}

TEST_F(Robots, ADifferentialDriveNeedsAGateAndTheDelay) {
  Run("35_differential_drive", 200);
  for (const char* filter : {"ekf", "ukf"}) {
    ExpectRms(filter, "robot.position", 0.334);
    ExpectRms(filter, "robot.heading", 0.457 * kDeg);
    ExpectConsistent(filter, "robot");
  }
  ExpectRms("rts", "robot.position", 0.152);
  ExpectRms("rts", "robot.heading", 0.200 * kDeg);
  ExpectConsistent("rts", "robot");
  ExpectNees("no_gate", "robot", 32.6);
  ExpectNees("no_delay", "robot", 1.57);
}

TEST_F(Robots, PositionsDetermineTheBiasesOfInertialNavigation) {
  Run("38_inertial_navigation", 100);
  ExpectRms("ekf", "body.position", 0.512);
  ExpectRms("ekf", "body.velocity", 0.414);
  ExpectRms("ekf", "body.orientation", 3.62 * kDeg);
  ExpectRms("ekf", "body.gyro_bias", 0.484 * kDeg);
  ExpectConsistent("ekf", "body");
  ExpectRms("rts", "body.position", 0.199);
  ExpectRms("rts", "body.orientation", 1.54 * kDeg);
  ExpectNees("rts", "body", 1.07);
}

TEST_F(Robots, ARadarTracksAConstantAcceleration) {
  Run("39_radar_tracking", 200);
  ExpectRms("ekf", "target.position", 10.7);
  ExpectRms("ekf", "target.velocity", 6.68);
  ExpectRms("iekf", "target.velocity", 6.45);
  ExpectRms("rts", "target.position", 5.19);
  ExpectNees("ekf", "target", 1.10);
  ExpectNees("ukf", "target", 1.08);
  ExpectConsistent("iekf", "target");
}

TEST_F(Robots, ARadarTracksACoordinatedTurn) {
  Run("39_radar_tracking", 200, "coordinated_turn.yaml");
  ExpectRms("ekf", "target.position", 7.18);
  ExpectRms("ekf", "target.heading", 2.56 * kDeg);
  ExpectRms("ekf", "target.speed", 1.97);
  ExpectRms("ukf", "target.position", 7.16);
  ExpectRms("rts", "target.position", 3.50);
  ExpectNees("ekf", "target", 1.03);
  ExpectConsistent("ukf", "target");
}

TEST_F(Robots, ASonarCalibratesABarometer) {
  Run("40_sonar_barometer", 200);
  ExpectRms("ekf", "drone.height", 0.0954);
  ExpectRms("ekf", "drone.climb_rate", 0.0569);
  ExpectRms("ekf", "barometer.bias", 0.0789);
  ExpectRms("rts", "drone.height", 0.0753);
  ExpectNees("ekf", "drone", 1.11);
  ExpectConsistent("barometer_only", "drone");
}

TEST_F(Robots, AttitudeIsConsistent) {
  Run("41_attitude", 200);
  for (const auto& [filter, degrees] :
       std::map<std::string, double>{{"ekf", 0.785}, {"iekf", 0.753}, {"ukf", 0.783}}) {
    ExpectRms(filter, "body.orientation", degrees * kDeg);
    ExpectConsistent(filter, "body");
  }
  ExpectRms("rts", "body.orientation", 0.409 * kDeg);
  ExpectRms("rts", "body.gyro_bias", 0.110 * kDeg);
  ExpectConsistent("rts", "body");
}

TEST_F(Robots, RangesDetermineTheirBiases) {
  Run("42_uwb_ranging", 200);
  for (const char* filter : {"ekf", "ukf"}) {
    ExpectRms(filter, "tag.position", 0.172);
    ExpectRms(filter, "tag.velocity", 0.201);
    ExpectRms(filter, "a1.bias", 0.0987);
    ExpectConsistent(filter, "tag");
  }
  ExpectRms("rts", "tag.position", 0.0605);
  ExpectConsistent("rts", "tag");
  ExpectNees("biases_ignored", "tag", 23.7);
}

TEST_F(Robots, BearingsAloneAreANonlinearMap) {
  Run("43_bearing_only_slam", 100);
  ExpectRms("ekf", "robot.position", 0.156);
  ExpectRms("ekf", "robot.heading", 0.515 * kDeg);
  ExpectNees("ekf", "robot", 1.18);
  ExpectNees("iekf", "robot", 9.07);
}

TEST_F(Robots, ACarDoesNotSlipSideways) {
  Run("44_motion_constraints", 200);
  ExpectRms("constrained", "car.position", 1.46);
  ExpectRms("constrained", "car.body_velocity", 0.090);
  ExpectRms("smoother", "car.position", 0.687);
  ExpectNees("free", "car", 0.656);
  ExpectConsistent("constrained", "car");
  EXPECT_LT(Of("constrained")["rmse:car.position"], 0.75 * Of("free")["rmse:car.position"]);
  EXPECT_LT(Of("constrained")["rmse:car.body_velocity"],
            0.2 * Of("free")["rmse:car.body_velocity"]);
}

TEST_F(Robots, ACarThatStandsKeepsItsHeading) {
  Run("44_motion_constraints", 200, "standing.yaml");
  ExpectRms("zero_velocity_update", "car.position", 1.28);
  ExpectRms("zero_velocity_update", "car.heading", 2.01 * kDeg);
  ExpectRms("smoother", "car.heading", 0.574 * kDeg);
  ExpectNees("free", "car", 0.749);
  ExpectNees("zero_velocity_update", "car", 0.571);
  EXPECT_LT(Of("zero_velocity_update")["rmse:car.heading"], 0.5 * Of("free")["rmse:car.heading"]);
}

}  // namespace
}  // namespace alidade
