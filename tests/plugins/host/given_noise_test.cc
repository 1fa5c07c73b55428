// SPDX-License-Identifier: Apache-2.0
//
// Tests noise given as a covariance: `covariance` of a sensor, and `noise.covariance` of a state
// entry.
#include <cmath>

#include "alidade/experiment/read_problem.h"
#include "alidade/plugin/plugin_host.h"
#include "host_fixture.h"

namespace alidade {
namespace {

using GivenNoise = HostTest;
using Values = std::vector<double>;

const PluginHost& ShippedModels() {
  static const PluginHost host;
  return host;
}

Values RootOfR(const SharedSensor& sensor) {
  const int m = sensor->measurement().geometry.tangent;
  Values l(static_cast<std::size_t>(m) * static_cast<std::size_t>(m), std::nan(""));
  // A given noise depends neither on states nor on the measurement.
  EXPECT_EQ(sensor->SqrtNoise(nullptr, nullptr, l.data()), Status::kOk);
  return l;
}

Values RootOfQ(const SharedMotion& motion, double dt_s) {
  const int n = motion->noise_size();
  Values l(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), std::nan(""));
  EXPECT_EQ(motion->SqrtQ(nullptr, nullptr, dt_s, l.data()), Status::kOk);
  return l;
}

const std::string kPixels =
    "alidade: 1\n"
    "camera: {width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240}\n"
    "state:\n"
    "  cam:\n"
    "    model: quaternion_pose\n"
    "    noise: {linear_acceleration: 1, angular_acceleration: 1}\n"
    "    initial:\n"
    "      position: {mean: [0, 0, 0], sigma: 0}\n"
    "      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}\n"
    "      velocity: {mean: [0, 0, 0], sigma: 1}\n"
    "      angular_velocity: {mean: [0, 0, 0], sigma: 1}\n"
    "landmarks: {representation: inverse_depth, convert_to_xyz: {max_linearity_index: 0.1},\n"
    "            prior: {inverse_distance: 0.5, sigma: 0.5}}\n"
    "sensors:\n"
    "  pixels:\n"
    "    model: inverse_depth_feature\n"
    "    stream: tracks\n"
    "    roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}\n";

Problem PixelsWith(const std::string& keys) {
  const Config config = Config::FromText(kPixels + "    " + keys + "\n", "test.yaml");
  return ReadProblem(config.root(), ShippedModels(), {});
}

// The root of [1 0.6; 0.6 4] = L L' is L = [1 0; 0.6 sqrt(4 - 0.36)], in px.
TEST_F(GivenNoise, IsThatOfEveryModelOfTheSensor) {
  const Values expected = {1.0, 0.0, 0.6, std::sqrt(4.0 - 0.6 * 0.6)};
  const Problem problem = PixelsWith("covariance: [[1, 0.6], [0.6, 4]]");
  EXPECT_EQ(RootOfR(problem.sensors[0].model), expected);
  ASSERT_TRUE(problem.sensors[0].xyz != nullptr);
  EXPECT_EQ(RootOfR(problem.sensors[0].xyz), expected);
  // The root is the same with a time offset, which adds roles to the sensor.
  const Problem late =
      PixelsWith("covariance: [[1, 0.6], [0.6, 4]]\n    time_offset_s: {mean: 0, sigma: 0.01}");
  EXPECT_GT(late.sensors[0].roles.size(), problem.sensors[0].roles.size());
  EXPECT_EQ(RootOfR(late.sensors[0].model), expected);
  EXPECT_EQ(RootOfR(late.sensors[0].xyz), expected);
}

TEST_F(GivenNoise, IsRefusedWhereItIsNoCovarianceOfTheMeasurement) {
  const auto refused = [](const std::vector<std::string>& words, const std::string& keys) {
    ExpectError(ExitCode::kBadConfig, words, [&] { PixelsWith(keys); });
  };
  const std::string where = "test.yaml:19:17 sensors.pixels.covariance: ";
  refused({where, "has 1 item", "2 rows of 2"}, "covariance: [[1]]");
  refused({where, "not a list of rows", "2 rows of 2"}, "covariance: 1");
  refused({where, "not symmetric", "[0][1] is 0.5"}, "covariance: [[1, 0.5], [0.6, 4]]");
  refused({where, "not positive semi-definite"}, "covariance: [[1, 3], [3, 4]]");
  refused({where, "singular", "positive definite"}, "covariance: [[1, 2], [2, 4]]");
  refused({where, "singular", "positive definite"}, "covariance: [[0, 0], [0, 4]]");
  refused({"test.yaml:20:15 sensors.pixels.sigma_px: ", "by `covariance`", "one of the two"},
          "covariance: [[1, 0], [0, 4]]\n    sigma_px: 1");
  refused({"sensors.pixels.sigma_px: missing", "px, > 0", "[u, v]"}, "use_less: 1");
}

TEST_F(GivenNoise, TakesNothingButTheNoiseFromAModel) {
  // The kind of noise is still read. template_px is not a sigma, so it is still required, although
  // R does not use it.
  const auto scale = [](const std::string& keys) {
    const Config config = Parse("{covariance: [[0.25]], " + keys + "}");
    const SharedSensor model = ShippedModels().CreateSensor("scale_2d", config.root());
    config.root().RejectUnread();
    return RootOfR(model);
  };
  EXPECT_EQ(scale("noise_model: constant"), Values{0.5});
  EXPECT_EQ(scale("template_px: 300"), Values{0.5});
  ExpectError(ExitCode::kBadConfig, {"template_px: missing"},
              [&] { scale("noise_model: propagated"); });
}

SharedMotion Motion(const Config& config, const std::string& name) {
  SharedMotion model = ShippedModels().CreateMotion(name, config.root());
  config.root().RejectUnread();
  return model;
}

TEST_F(GivenNoise, OfAMotionModelIsThatOfItsInputs) {
  const Config config =
      Parse("{dimensions: 2, noise: {kind: discrete, covariance: [[4, -1], [-1, 1]]}}");
  const SharedMotion model = Motion(config, "constant_velocity");
  // The noise is a held acceleration, in m/s^2. Its root therefore does not depend on dt.
  for (const double dt_s : {0.1, 3.0}) {
    EXPECT_EQ(RootOfQ(model, dt_s), (Values{2.0, 0.0, -0.5, std::sqrt(0.75)}));
  }
}

// The body moves in a plane. 3 of its 6 inputs have no noise, and two others have a common noise.
TEST_F(GivenNoise, OfAMotionModelMayBeSingular) {
  const Config config = Parse(
      "noise:\n"
      "  kind: discrete\n"
      "  covariance: [[0.09, 0.09, 0, 0, 0, 0], [0.09, 0.09, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0],\n"
      "               [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0.04]]\n");
  Values expected(36, 0.0);
  expected[0] = expected[6] = 0.3;
  expected[35] = 0.2;
  EXPECT_EQ(RootOfQ(Motion(config, "quaternion_pose"), 0.1), expected);
}

TEST_F(GivenNoise, OfAMotionModelIsRefusedWhereItDoesNotFit) {
  const auto refused = [](const char* model, const std::string& text,
                          const std::vector<std::string>& words) {
    ExpectError(ExitCode::kBadConfig, words, [&] { Motion(Parse(text), model); });
  };
  const std::vector<std::string> continuous = {"noise.covariance", "continuous noise",
                                               "noise.kind: discrete"};
  refused("constant_velocity", "noise: {covariance: [[1]]}", continuous);
  refused("constant", "noise: {covariance: [[1]]}", continuous);
  refused("constant_velocity", "noise: {kind: discrete, acceleration: 1, covariance: [[1]]}",
          {"noise.acceleration: ", "by `covariance`", "one of the two"});
  refused("quaternion_pose", "noise: {kind: discrete, covariance: [[1]]}",
          {"noise.covariance: has 1 item", "6 rows of 6"});
}

}  // namespace
}  // namespace alidade
