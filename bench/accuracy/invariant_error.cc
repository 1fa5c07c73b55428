// SPDX-License-Identifier: Apache-2.0
//
// Compares an EKF with the error of the blocks and EKFs with an invariant error, in the way of
// [Barrau2017] sec. V: a vehicle with an inertial unit, whose initial heading is almost unknown.
//
//   accuracy_invariant_error [SEEDS]
//
// Runs the seeds 1, 2, ... (default: 100) with measured positions in the world (gnss), and with
// known points that are measured in the frame of the body (points). Prints the table of
// docs/estimators.md: the means at 3, 10 and 20 s of NEES / 9, of the error of the heading in deg,
// and of the error of the position in m.
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <utility>

#include "support/inertial_runs.h"

int main(int argc, char** argv) {
  using alidade::ErrorSide;
  using alidade::testing::InertialSensor;
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
  constexpr std::pair<const char*, InertialSensor> kSensors[] = {
      {"gnss", InertialSensor::kGnss}, {"points", InertialSensor::kPoints}};
  const std::pair<const char*, std::optional<ErrorSide>> errors[] = {
      {"plain", std::nullopt}, {"left", ErrorSide::kLeft}, {"right", ErrorSide::kRight}};
  std::printf(
      "| sensor | error | NEES / 9 | heading, deg | position, m |\n|---|---|---|---|---|\n");
  for (const auto& [sensor_name, sensor] : kSensors) {
    for (const auto& [error_name, side] : errors) {
      const auto mean = alidade::testing::MeanErrors(sensor, side, {3.0, 10.0, 20.0}, seeds);
      constexpr double kDegree = std::numbers::pi / 180.0;
      std::printf("| %s | %s | %.2f, %.2f, %.2f | %.1f, %.1f, %.1f | %.2f, %.2f, %.2f |\n",
                  sensor_name, error_name, mean[0].nees, mean[1].nees, mean[2].nees,
                  mean[0].heading_rad / kDegree, mean[1].heading_rad / kDegree,
                  mean[2].heading_rad / kDegree, mean[0].position_m, mean[1].position_m,
                  mean[2].position_m);
    }
  }
  return 0;
}
