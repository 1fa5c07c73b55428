// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/filter_parameters.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/config_text.h"

namespace alidade::internal {
namespace {

constexpr const char* kConfig = R"(
state:
  body:
    noise: {kind: continuous, linear_acceleration: [1, 2, 3], angular_acceleration: 0.5}
    constant: [lever_arm, orientation]
    initial:
      position: {mean: [0, 0, 0], sigma: 0.1}
      lever_arm: {mean: [0.1, 0.2], sigma: 1}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}}
  unused: {noise: {acceleration: 1}}
sensors:
  gnss:
    sigma_m: 3
    noise_model: constant
    loss: {huber: 1.345}
    dynamics: {clock_bias: {gauss_markov: {sigma: 4, time_constant_s: 10}}}
  camera: {sigma_px: 1, time_offset_s: {mean: 0, sigma: 0.05}, dynamics: {focal: {random_walk: 5}}}
  late: {sigma_m: 2, time_offset_s: 0.02}
  other: {sigma_m: 1}
)";

std::vector<FilterParameter> Parameters(const Config& config) {
  Problem problem;
  problem.motions.push_back({"body", {}, {}});
  problem.motions.push_back({"gnss.clock_bias", {}, {}});
  for (const char* name : {"gnss", "camera", "late"})
    problem.sensors.push_back({name, name, {}, {}});
  return FilterParametersOf(config.root(), problem);
}

TEST(FilterParameters, AreTheDeviationsOffsetsAndConstantsOfTheFilter) {
  const Config config = testing::Read(kConfig);
  std::vector<std::string> names;
  for (const FilterParameter& parameter : Parameters(config)) {
    names.push_back(parameter.name() + (parameter.is_deviation ? " sigma" : ""));
  }
  const std::vector<std::string> expected = {
      "state.body.noise.linear_acceleration[0] sigma",
      "state.body.noise.linear_acceleration[1] sigma",
      "state.body.noise.linear_acceleration[2] sigma",
      "state.body.noise.angular_acceleration sigma",
      "state.body.initial.lever_arm.mean[0]",
      "state.body.initial.lever_arm.mean[1]",
      "sensors.gnss.sigma_m sigma",
      "sensors.gnss.dynamics.clock_bias.gauss_markov.sigma sigma",
      "sensors.gnss.time_offset_s",
      "sensors.camera.sigma_px sigma",
      "sensors.camera.dynamics.focal.random_walk sigma",
      "sensors.late.sigma_m sigma",
      "sensors.late.time_offset_s"};
  EXPECT_EQ(names, expected);
}

TEST(FilterParameters, AMissingTimeOffsetIsZero) {
  const Config config = testing::Read(kConfig);
  std::vector<double> offsets;
  for (const FilterParameter& parameter : Parameters(config)) {
    if (parameter.key.ends_with("time_offset_s")) offsets.push_back(parameter.value());
  }
  EXPECT_EQ(offsets, (std::vector<double>{0.0, 0.02}));
}

TEST(FilterParameters, YamlHasTheOtherNumbersOfAList) {
  const FilterParameter number{"a", {1.0}}, element{"a", {1.0, 2.0, 3.0}, 1, true, true};
  EXPECT_EQ(number.YamlOf(0.5), "0.5");
  EXPECT_EQ(element.value(), 2.0);
  EXPECT_EQ(element.YamlOf(0.5), "[1, 0.5, 3]");
}

}  // namespace
}  // namespace alidade::internal
