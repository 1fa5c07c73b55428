// SPDX-License-Identifier: Apache-2.0
//
// Tests the source `models`. Truth and measurements must have the distribution that a filter with
// the same config assumes, and each key must have its effect.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/plugin_host.h"
#include "support/config_text.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

using testing::Message;

/// Config of a target near 10 m. The disparity is so accurate that h is nearly linear.
const std::string kState =
    "alidade: 1\n"
    "state:\n"
    "  target:\n"
    "    model: constant_velocity\n"
    "    noise: {kind: KIND, acceleration: 0.5}\n"
    "    initial: {position: {mean: 10, sigma: 0.2}, velocity: {mean: 0.1, sigma: 0.3}}\n"
    "sensors:\n"
    "  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.position},\n"
    "           focal_px: 400, baseline_m: 0.5, sigma_px: 0.02}\n";

Config Parse(std::string text, const std::string& kind = "continuous") {
  text.replace(text.find("KIND"), 4, kind);
  return testing::Read(text);
}

const PluginHost& Shipped() {
  static const PluginHost host(std::vector<std::filesystem::path>{});
  return host;
}

std::vector<SourceFrame> FramesOf(const Config& config, std::uint64_t seed = 1) {
  const auto source = CreateSource(Shipped(), config, seed);
  std::vector<SourceFrame> frames;
  for (SourceFrame frame; source->Next(frame);) frames.push_back(frame);
  return frames;
}

std::string Refusal(const std::string& text) {
  return Message([&] { CreateSource(Shipped(), Parse(text), 1); });
}

/// Expects that a metric of the first estimator has the mean 1 over `runs` seeds, and that no run
/// fails.
void ExpectOne(const std::string& metric, const Config& config, int runs, double tolerance) {
  if (testing::kSanitized) runs = 2;
  double sum = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    Config one = config.Merged(
        Config::FromText("source: {seed: " + std::to_string(seed) + "}", "seed").root());
    Experiment experiment = BuildExperiment(one, Shipped());
    const RunResult run = Run(experiment, {});
    EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
    sum += run.estimators.at(0).metrics.at(metric);
  }
  if (!testing::kSanitized) {
    EXPECT_NEAR(sum / runs, 1.0, tolerance) << metric;
  }
}

// The mean NEES of a filter with the true models is 1. Each run has 2 degrees of freedom, which are
// correlated over about the whole run. The standard deviation of the mean over 300 runs is
// therefore at most 0.06.
TEST(Models, AFilterOfTheSameConfigIsConsistent) {
  for (const char* kind : {"continuous", "discrete"}) {
    for (const char* sensors :
         {"", ", sensors: {stereo: {rate_hz: 4}}", ", sensors: {stereo: {missing: 0.7}}"}) {
      const Config config = Parse(kState + "source: {type: models, duration_s: 3, rate_hz: 20" +
                                      sensors + "}\nestimators: {ekf: {type: ekf}}\n",
                                  kind);
      SCOPED_TRACE(std::string(kind) + sensors);
      ExpectOne("nees.mean:target", config, 300, 0.1);
      ExpectOne("nis.mean:stereo", config, 100, 0.1);
    }
  }
}

// A camera moves among points. Tests the orientation, the landmarks with their representation, and
// the true map.
TEST(Models, DrawsLandmarks) {
  const std::string text =
      "alidade: 1\n"
      "camera: {model: pinhole, width: 640, height: 480, fx: 400, fy: 400, cx: 320, cy: 240}\n"
      "state:\n"
      "  cam:\n"
      "    model: quaternion_pose\n"
      "    noise: {kind: continuous, linear_acceleration: 0.1, angular_acceleration: 0.05}\n"
      "    initial:\n"
      "      position: {mean: [0, 0, 0], sigma: 0}\n"
      "      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}\n"
      "      velocity: {mean: [0.2, 0, 0], sigma: 0.1}\n"
      "      angular_velocity: {mean: [0, 0, 0], sigma: 0.05}\n"
      "landmarks: {representation: anchored}\n"
      "sensors:\n"
      "  depth: {model: depth_feature, stream: tracks, sigma_px: 1, sigma_depth_m: 0.02,\n"
      "          roles: {position: cam.position, orientation: cam.orientation, landmark: "
      "landmarks}}\n"
      "source: {type: models, duration_s: 1, rate_hz: 15,\n"
      "         landmarks: {count: 30, max_per_frame: 8, box: {min: [-2, -1, 3], max: [2, 1, "
      "5]}}}\n"
      "estimators: {ekf: {type: ekf}}\n";
  const Config config = testing::Read(text);
  for (const SourceFrame& frame : FramesOf(config)) {
    ASSERT_EQ(frame.measurements.size(), 8u);
    for (const Measurement& one : frame.measurements) {
      EXPECT_GE(one.landmark, 0);
      EXPECT_LT(one.landmark, 30);
      EXPECT_TRUE(one.values[0] >= -0.5 && one.values[0] <= 639.5);  // u is in the image
    }
  }
  const auto source = CreateSource(Shipped(), config, 1);
  for (int id = 0; id < 30; ++id) {
    const auto place = source->TrueLandmark(id);
    ASSERT_TRUE(place);
    EXPECT_TRUE(std::abs((*place)[0]) <= 2 && std::abs((*place)[1]) <= 1);
    EXPECT_TRUE((*place)[2] >= 3 && (*place)[2] <= 5);
  }
  EXPECT_FALSE(source->TrueLandmark(30));
  ExpectOne("nees.mean:cam", config, 60, 0.15);
}

TEST(Models, ANoiseIsThatOfItsOwnSeedAndSensor) {
  const std::string two = kState +
                          "  other: {model: stereo_disparity, stream: again, focal_px: 400,\n"
                          "          baseline_m: 0.5, sigma_px: 1, roles: {depth: "
                          "target.position}}\nsource: {type: models";
  const auto plain = FramesOf(Parse(two + "}")), same = FramesOf(Parse(two + "}"));
  const auto lossy = FramesOf(Parse(two + ", sensors: {stereo: {missing: 1}}}"));
  const auto other = FramesOf(Parse(two + "}"), 2);
  ASSERT_EQ(plain.size(), 301u);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_EQ(plain[i].truth, same[i].truth);
    EXPECT_EQ(plain[i].measurements[0].values, same[i].measurements[0].values);
    EXPECT_NE(plain[i].measurements[0].values, other[i].measurements[0].values);
    // A missing measurement of one sensor changes neither the truth nor the noise of the other
    // sensor.
    ASSERT_EQ(lossy[i].measurements.size(), 1u);
    EXPECT_EQ(lossy[i].truth, plain[i].truth);
    EXPECT_EQ(lossy[i].measurements[0].values, plain[i].measurements[1].values);
  }
}

// Compares the covariance of the initial states over many draws with the prior. The prior has
// correlations and is singular.
TEST(Models, TheStartIsDrawnFromThePrior) {
  const std::string text =
      "alidade: 1\n"
      "state:\n"
      "  a: {model: constant, size: 3, initial: {value: {mean: [1, 2, 3],\n"
      "      covariance: [[4, 1.2, 0], [1.2, 1, 0], [0, 0, 0]]}}}\n"
      "  b: {model: constant, initial: {value: {mean: 2, sigma: 0}}}\n"
      "sensors:\n"
      "  stereo: {model: stereo_disparity, stream: d, roles: {depth: b.value}, focal_px: 400,\n"
      "           baseline_m: 0.5, sigma_px: 1}\n"
      "source: {type: models, duration_s: 0}\n";
  const Config config = testing::Read(text);
  constexpr int kDraws = 4000;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (int seed = 1; seed <= kDraws; ++seed) {
    const std::vector<double> x = FramesOf(config, static_cast<std::uint64_t>(seed))[0].truth[0];
    const Eigen::Vector3d d = Eigen::Vector3d::Map(x.data()) - Eigen::Vector3d(1, 2, 3);
    mean += d / kDraws;
    moment += d * d.transpose() / kDraws;
  }
  EXPECT_LT(mean.norm(), 0.15);  // the standard deviation is 0.035
  Eigen::Matrix3d expected;
  expected << 4, 1.2, 0, 1.2, 1, 0, 0, 0, 0;
  EXPECT_LT((moment - expected).cwiseAbs().maxCoeff(), 0.4);  // the largest deviation is 0.09
  EXPECT_EQ(moment(2, 2), 0.0);
}

TEST(Models, TheStartCanBeGiven) {
  const Config at_mean = Parse(kState + "source: {type: models, start: mean, duration_s: 0}");
  EXPECT_EQ(FramesOf(at_mean)[0].truth, (std::vector<std::vector<double>>{{10}, {0.1}}));
  const Config given =
      Parse(kState + "source: {type: models, initial: {target: {velocity: -1}}, duration_s: 0}");
  EXPECT_EQ(FramesOf(given)[0].truth[1], std::vector<double>{-1});
  EXPECT_NE(FramesOf(given)[0].truth[0], std::vector<double>{10});
}

// The priors apply at initial_time_s. The first measurements have this time.
TEST(Models, StartsAtTheTimeOfThePriors) {
  const auto frames =
      FramesOf(Parse(kState + "initial_time_s: 4\nsource: {type: models, rate_hz: 10}"));
  EXPECT_EQ(frames[0].timestamp, TimestampFromSeconds(4.0));
  EXPECT_EQ(frames[1].timestamp, TimestampFromSeconds(4.1));
}

TEST(Models, TheTruthCanHaveAModelOfItsOwn) {
  const Config config = Parse(
      kState +
      "source: {type: models, start: mean, rate_hz: 10, duration_s: 1,\n"
      "  overrides: {state: {target: {noise: {acceleration: 0}}}, sensors: {stereo: {sigma_px: "
      "1e-12}}}}");
  const auto frames = FramesOf(config);
  ASSERT_EQ(frames.size(), 11u);
  EXPECT_NEAR(frames[10].truth[0][0], 10.1, 1e-12);
  EXPECT_NEAR(frames[10].measurements[0].values[0], 200 / 10.1, 1e-10);
}

TEST(Models, SensorsHaveRatesGapsAndOutliers) {
  const std::string text =  // the target recedes, so h is always defined
      kState +
      "source: {type: models, rate_hz: 100, duration_s: 100, start: mean,\n"
      "  overrides: {state: {target: {noise: {acceleration: 0}}}}, ";
  std::size_t count = 0;
  for (const SourceFrame& frame : FramesOf(Parse(text + "sensors: {stereo: {rate_hz: 30}}}"))) {
    count += frame.measurements.size();
  }
  EXPECT_EQ(count, 3001u);
  count = 0;
  for (const SourceFrame& frame : FramesOf(Parse(text + "sensors: {stereo: {missing: 0.25}}}"))) {
    count += frame.measurements.size();
  }
  EXPECT_NEAR(static_cast<double>(count), 7500, 200);  // the standard deviation is 43
  int far = 0, farther = 0;
  for (const SourceFrame& frame :
       FramesOf(Parse(text + "sensors: {stereo: {outliers: {share: 0.1, sigma_scale: 100}}}}"))) {
    const double error = frame.measurements[0].values[0] - 200 / frame.truth[0][0];
    far += std::abs(error) > 4 * 0.02 ? 1 : 0;
    farther += std::abs(error) > 100 * 0.02 ? 1 : 0;
  }
  EXPECT_NEAR(far, 969, 120);     // 10 001 times 0.1 P(|n| > 0.04)
  EXPECT_NEAR(farther, 317, 70);  // 10 001 times 0.1 P(|n| > 1)
}

// A control input acts on the true state until the next frame, as it does in the filter.
TEST(Models, GivesControlInputs) {
  const std::string text =
      "alidade: 1\n"
      "state:\n"
      "  cam:\n"
      "    model: odometry_pose\n"
      "    input: {stream: odometry}\n"
      "    noise: {kind: discrete, linear_velocity: 0, angular_velocity: 0}\n"
      "    initial:\n"
      "      position: {mean: [0, 0, 0], sigma: 0}\n"
      "      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}\n"
      "  b: {model: constant, initial: {value: {mean: 2, sigma: 0}}}\n"
      "sensors:\n"
      "  stereo: {model: stereo_disparity, stream: d, roles: {depth: b.value}, focal_px: 400,\n"
      "           baseline_m: 0.5, sigma_px: 1}\n"
      "source: {type: models, rate_hz: 10, duration_s: 1, sensors: {stereo: {missing: 1}},\n"
      "         inputs: {cam: INPUT}}\n";
  const auto with = [&](std::string input) {
    std::string all = text;
    return testing::Read(all.replace(all.find("INPUT"), 5, input));
  };
  const auto still = FramesOf(with("{mean: [0, 0, 0, 0, 0, 0]}"));
  EXPECT_EQ(still.back().truth[0], (std::vector<double>{0, 0, 0}));
  const auto wave = FramesOf(
      with("{mean: [1, 0, 0, 0, 0, 0], amplitude: [0.5, 0, 0, 0, 0, 0], frequency_hz: 0.7}"));
  double x = 0.0;
  for (std::size_t i = 0; i < wave.size(); ++i) {
    EXPECT_NEAR(wave[i].truth[0][0], x, 1e-12);
    ASSERT_EQ(wave[i].measurements.size(), 1u);
    const double t_s = 0.1 * static_cast<double>(i);
    const double u = 1.0 + 0.5 * std::sin(2 * M_PI * 0.7 * t_s);
    EXPECT_NEAR(wave[i].measurements[0].values[0], u, 1e-12);
    x += 0.1 * u;
  }
}

TEST(Models, RefusesByKeyAndRemedy) {
  const std::string source = kState + "source: {type: models, ";
  EXPECT_NE(Refusal(source + "sensors: {sterio: {missing: 0}}}")
                .find("source.sensors.sterio: unknown key"),
            std::string::npos);
  EXPECT_NE(
      Refusal(source + "sensors: {stereo: {rate_hz: 31}}}").find("source.sensors.stereo.rate_hz"),
      std::string::npos);
  EXPECT_NE(Refusal(source + "sensors: {stereo: {missing: 1.5}}}")
                .find("source.sensors.stereo.missing: '1.5' is out of range"),
            std::string::npos);
  EXPECT_NE(Refusal(source + "landmarks: {count: 3, box: {min: [0,0,0], max: [1,1,1]}}}")
                .find("no sensor measures landmarks"),
            std::string::npos);
  EXPECT_NE(Refusal(source + "initial: {depth: 3}}").find("source.initial.depth: unknown key"),
            std::string::npos);
  EXPECT_NE(
      Refusal(source + "inputs: {target: {mean: 0}}}").find("source.inputs.target: unknown key"),
      std::string::npos);
  std::string from = source;
  const std::string prior = "{mean: 10, sigma: 0.2}";
  from.replace(from.find(prior), prior.size(), "{from_measurement: stereo}");
  const std::string message = Refusal(from + "seed: 1}");
  EXPECT_NE(message.find("block 'target.position' starts from a measurement"), std::string::npos);
  EXPECT_NE(message.find("source.initial: {target: {position: value}}"), std::string::npos);
  for (const char* overrides : {"sensor: {stereo: {sigma_px: 2}}", "source: {rate_hz: 1}"}) {
    const std::string why = Refusal(source + "overrides: {" + overrides + "}}");
    EXPECT_NE(why.find("the simulator does not read the key 's"), std::string::npos) << why;
  }
}

}  // namespace
}  // namespace alidade
