// SPDX-License-Identifier: Apache-2.0
//
// Tests the errors of a stream whose size is not that of the measurement.
#include <gtest/gtest.h>

#include <string>

#include "alidade/experiment/experiment.h"
#include "support/config_text.h"

namespace alidade {
namespace {

using testing::Message;

/// Returns the error of a config with this sensor of a point in the plane.
std::string ErrorOf(const std::string& sensor) {
  const PluginHost host;
  return Message([&] {
    BuildExperiment(
        Config::FromText("alidade: 1\n"
                         "state: {point: {model: constant_velocity, dimensions: 2, noise: "
                         "{acceleration: 1}, initial: {position: exact, velocity: exact}}}\n"
                         "source: {type: depth_target}\n"
                         "estimators: [ekf]\n"
                         "sensors: {s: " +
                             sensor + "}\n",
                         "f.yaml"),
        host);
  });
}

// The block selects the size of the measurement, so the role may be the error.
TEST(CheckStreams, NamesTheRoleThatSelectsTheSize) {
  EXPECT_EQ(ErrorOf("{model: direct, stream: disparity, sigma: 1, roles: {value: point.position}}"),
            "f.yaml:5:74 sensors.s.roles.value: block 'point.position' has the geometry vector(2), "
            "so the measurement of model 'direct' has 2 values, but stream 'disparity' has 1 value "
            "per measurement; expected another block, or a stream of 2 values");
}

// The keys select the size: a range and an azimuth are two values for every position.
TEST(CheckStreams, NamesTheStreamOfAModelOfOneSize) {
  EXPECT_EQ(ErrorOf("{model: radar, stream: disparity, roles: point, sigma_range_m: 1, "
                    "sigma_azimuth_rad: 1}"),
            "f.yaml:5:37 sensors.s.stream: stream 'disparity' has 1 value per measurement; "
            "expected 2, the size of the measurement of model 'radar'");
}

}  // namespace
}  // namespace alidade
