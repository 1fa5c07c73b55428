// SPDX-License-Identifier: Apache-2.0
//
// Tests sensors with their own states, known numbers or several parts: from a config, in the
// simulator and in every estimator.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/plugin_host.h"
#include "support/config_text.h"
#include "support/sanitized.h"

namespace alidade {
namespace {

using testing::Message;

const PluginHost& TheHost() {
  static const PluginHost host(std::vector<std::filesystem::path>{});
  return host;
}

/// Config of a receiver that drifts among six satellites. STATE, ROLE and KEYS stand for a state
/// entry of the clock, its role in the sensor, and further keys of the sensor.
const std::string kReceiver =
    "alidade: 1\n"
    "state:\n"
    "  receiver:\n"
    "    model: constant_velocity\n"
    "    dimensions: 3\n"
    "    noise: {kind: continuous, acceleration: 0.3}\n"
    "    initial: {position: {mean: [0, 0, 0], sigma: 20}, velocity: {mean: [1, 0, 0], sigma: 1}}\n"
    "STATE"
    "sensors:\n"
    "  gnss: {model: pseudorange, stream: ranges, sigma_m: 2, roles: {position: receiver.position"
    "ROLE}KEYS}\n"
    "source: {type: models, duration_s: 20, rate_hz: 2, seed: 1, sensors: {gnss: {known:\n"
    "  [[2e7, 0, 1e7], [-1e7, 2e7, 1e7], [0, -2e7, 1e7], [1e7, 1e7, 2e7], [-2e7, -1e7, 1.5e7],\n"
    "   [0, 0, 2.2e7]]}}}\n"
    "estimators:\n"
    "  ekf: {type: ekf}\n  iekf: {type: iekf}\n  root: {type: square_root_ekf}\n"
    "  ukf: {type: ukf}\n  rts: {type: rts}\n";

std::string Filled(const std::string& state, const std::string& role, const std::string& keys) {
  std::string text = kReceiver;
  const auto fill = [&](const std::string& place, const std::string& with) {
    text.replace(text.find(place), place.size(), with);
  };
  fill("STATE", state);
  fill("ROLE", role);
  fill("KEYS", keys);
  return text;
}

RunResult RunOf(const std::string& text, int seed = 1) {
  const Config config = testing::Read(text);
  Config one = config.Merged(
      Config::FromText("source: {seed: " + std::to_string(seed) + "}", "seed").root());
  Experiment experiment = BuildExperiment(one, TheHost());
  const RunResult run = Run(experiment, {});
  EXPECT_EQ(run.status, RunStatus::kOk) << run.reason;
  return run;
}

/// Expects equal metrics of the receiver. The receiver has the same name in both problems.
void ExpectSameReceiver(const RunResult& a, const RunResult& b, double relative) {
  ASSERT_EQ(a.estimators.size(), b.estimators.size());
  int compared = 0;
  for (std::size_t i = 0; i < a.estimators.size(); ++i) {
    for (const auto& [name, value] : a.estimators[i].metrics) {
      if (name.find("receiver") == std::string::npos) continue;
      const auto other = b.estimators[i].metrics.find(name);
      ASSERT_NE(other, b.estimators[i].metrics.end()) << name;
      if (std::isnan(value) && std::isnan(other->second)) continue;
      EXPECT_NEAR(value, other->second, relative * (1.0 + std::abs(value)))
          << a.estimators[i].name << ' ' << name;
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
}

TEST(SensorStates, AClockThatTheSensorOwnsIsTheSameWrittenByHand) {
  const RunResult owned = RunOf(Filled("", "", ""));
  const RunResult by_hand =
      RunOf(Filled("  clock: {model: constant, blocks: {value: bias}, noise: {random_walk: 1},\n"
                   "          initial: {bias: {mean: 0, sigma: 1e5}}}\n",
                   ", clock_bias: clock.bias", ""));
  ExpectSameReceiver(owned, by_hand, 1e-12);
  for (const EstimatorResult& one : owned.estimators) {
    EXPECT_EQ(one.metrics.count("rmse:gnss.clock_bias"), 1u) << one.name;
    EXPECT_TRUE(one.unobservable.empty()) << one.name;
  }
}

TEST(SensorStates, TheConfigHasTheLastWord) {
  const RunResult owned =
      RunOf(Filled("", "",
                   ", initial: {clock_bias: {mean: 30, sigma: 50}}, dynamics: {clock_bias: "
                   "{random_walk: 0.2}}"));
  const RunResult by_hand =
      RunOf(Filled("  clock: {model: constant, blocks: {value: bias}, noise: {random_walk: 0.2},\n"
                   "          initial: {bias: {mean: 30, sigma: 50}}}\n",
                   ", clock_bias: clock.bias", ""));
  ExpectSameReceiver(owned, by_hand, 1e-12);
  const RunResult constant =
      RunOf(Filled("", "", ", constant: [clock_bias], initial: {clock_bias: {mean: 7}}"));
  const RunResult known =
      RunOf(Filled("  clock: {model: constant, blocks: {value: bias}, constant: [bias],\n"
                   "          initial: {bias: {mean: 7}}}\n",
                   ", clock_bias: clock.bias", ""));
  ExpectSameReceiver(constant, known, 1e-12);
}

TEST(SensorStates, AreConstantIfTheirInitialValueIsExact) {
  const auto status = [](const std::string& keys) {
    const Config config = testing::Read(Filled("", "", keys));
    const Experiment experiment = BuildExperiment(config, TheHost());
    const StateLayout& layout = experiment.estimators[0].problem.layout;
    return layout[layout.Find("gnss.clock_bias")].status;
  };
  const std::string exact = ", initial: {clock_bias: {mean: 3, sigma: 0}}";
  EXPECT_EQ(status(exact + ", dynamics: {clock_bias: constant}"), BlockStatus::kConstant);
  EXPECT_EQ(status(exact + ", dynamics: {clock_bias: {random_walk: 1}}"), BlockStatus::kEstimated);
}

TEST(SensorStates, CanBeConsidered) {
  std::string owned = Filled("", "",
                             ", consider: [clock_bias], initial: {clock_bias: {mean: 0, "
                             "sigma: 5}}, dynamics: {clock_bias: constant}");
  std::string by_hand = Filled(
      "  clock: {model: constant, blocks: {value: bias}, consider: [bias],\n"
      "          initial: {bias: {mean: 0, sigma: 5}}}\n",
      ", clock_bias: clock.bias", "");
  for (std::string* text : {&owned, &by_hand}) {
    *text = text->substr(0, text->find("estimators:")) + "estimators: {ekf: {type: ekf}}\n";
  }
  const RunResult a = RunOf(owned), b = RunOf(by_hand);
  EXPECT_DOUBLE_EQ(a.estimators[0].metrics.at("rmse:receiver.position"),
                   b.estimators[0].metrics.at("rmse:receiver.position"));
}

/// Returns, for each estimator, the mean of a metric over seeds.
std::map<std::string, double> MeansOf(const std::string& text, const std::string& metric,
                                      int runs) {
  std::map<std::string, double> means;
  if (testing::kSanitized) {  // one run is enough for a sanitizer to report errors
    RunOf(text);
    return means;
  }
  for (int seed = 1; seed <= runs; ++seed) {
    for (const EstimatorResult& one : RunOf(text, seed).estimators) {
      means[one.name] += one.metrics.at(metric) / runs;
    }
  }
  return means;
}

// The receiver has six degrees of freedom, which are correlated over the whole run. The standard
// deviation of the mean over 40 runs is therefore at most 0.1.
TEST(SensorStates, AFilterThatOwnsItsClockIsConsistent) {
  for (const auto& [name, nees] : MeansOf(Filled("", "", ""), "nees.mean:receiver", 40)) {
    EXPECT_NEAR(nees, 1.0, 0.25) << name;
  }
  // This bias returns to its mean within the run, so the stationary variance of the bias matters.
  const std::string markov =
      Filled("", "",
             ", initial: {clock_bias: {mean: 0, sigma: 8}}, dynamics: {clock_bias: {gauss_markov: "
             "{sigma: 8, time_constant_s: 3}}}");
  for (const auto& [name, nees] : MeansOf(markov, "nees.mean:gnss", 40)) {
    EXPECT_NEAR(nees, 1.0, 0.2) << name;
  }
}

// The process is stationary from the start on. The variance of many draws at the end must equal
// that at the start.
TEST(SensorStates, AGaussMarkovStateKeepsItsVariance) {
  const Config config =
      testing::Read(Filled("", "",
                           ", initial: {clock_bias: {mean: 3, sigma: 2}}, dynamics: {clock_bias: "
                           "{gauss_markov: {sigma: 2, time_constant_s: 1.5}}}"));
  constexpr int kDraws = testing::kSanitized ? 5 : 600;
  double sum = 0.0, squares = 0.0, lagged = 0.0;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const auto source = CreateSource(TheHost(), config, seed);
    double last = 0.0, before = 0.0;
    for (SourceFrame frame; source->Next(frame);) {
      before = std::exchange(last, frame.truth.back().at(0) - 3.0);
    }
    sum += last / kDraws;
    squares += last * last / kDraws;
    lagged += last * before / kDraws;
  }
  if (testing::kSanitized) return;
  EXPECT_NEAR(sum, 0.0, 0.35);                               // the standard deviation is 0.08
  EXPECT_NEAR(squares, 4.0, 0.9);                            // the standard deviation is 0.23
  EXPECT_NEAR(lagged / squares, std::exp(-0.5 / 1.5), 0.1);  // frames are 0.5 s apart
}

const std::string kPose =
    "alidade: 1\n"
    "state:\n"
    "  body:\n"
    "    model: quaternion_pose\n"
    "    noise: {kind: continuous, linear_acceleration: 0.3, angular_acceleration: 0.2}\n"
    "    initial:\n"
    "      position: {mean: [0, 0, 0], sigma: 0.5}\n"
    "      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0.1}\n"
    "      velocity: {mean: [0.5, 0, 0], sigma: 0.2}\n"
    "      angular_velocity: {mean: [0, 0, 0.5], sigma: 0.1}\n"
    "sensors:\n"
    "  mocap: {model: pose, stream: pose, sigma_position_m: 0.05, sigma_orientation_rad: 0.03,\n"
    "          roles: {position: body.position, orientation: body.orientation}}\n"
    "source: {type: models, duration_s: 5, rate_hz: 10}\n"
    "estimators:\n"
    "  ekf: {type: ekf}\n  iekf: {type: iekf}\n  root: {type: square_root_ekf}\n"
    "  ukf: {type: ukf}\n  rts: {type: rts}\n";

// The body has twelve degrees of freedom, so the mean NEES over 30 runs has a standard deviation of
// at most 0.08.
TEST(SensorStates, AFilterOfPosesIsConsistent) {
  for (const auto& [name, nees] : MeansOf(kPose, "nees.mean:body", 30)) {
    EXPECT_NEAR(nees, 1.0, 0.2) << name;
  }
  for (const auto& [name, nis] : MeansOf(kPose, "nis.mean:mocap", 20)) {
    EXPECT_NEAR(nis, 1.0, 0.1) << name;
  }
}

/// Config of two sensors of a target. The timestamps of the second sensor are off by about 50 ms.
const std::string kLate =
    "alidade: 1\n"
    "state:\n"
    "  target: {model: constant_velocity, noise: {kind: continuous, acceleration: 0.4},\n"
    "    initial: {position: {mean: 40, sigma: 0.2}, velocity: {mean: -3, sigma: 0.2}}}\n"
    "sensors:\n"
    "  left: {model: stereo_disparity, stream: left, roles: {depth: target.position},\n"
    "    focal_px: 400, baseline_m: 0.5, sigma_px: 0.05}\n"
    "  right: {model: stereo_disparity, stream: right, roles: {depth: target.position},\n"
    "    focal_px: 400, baseline_m: 0.5, sigma_px: 0.05, time_offset_s: OFFSET}\n"
    "source: {type: models, duration_s: 8, rate_hz: 20 TRUTH}\n"
    "estimators:\n"
    "  ekf: {type: ekf}\n  iekf: {type: iekf}\n  root: {type: square_root_ekf}\n"
    "  ukf: {type: ukf}\n  rts: {type: rts}\n";

std::string Late(const std::string& offset, const std::string& truth = "") {
  std::string text = kLate;
  text.replace(text.find("OFFSET"), 6, offset);
  return text.replace(text.find("TRUTH"), 5, truth);
}

// The offset has one degree of freedom per run. The target has two degrees of freedom, which are
// correlated over a second. The standard deviations of the means are 0.14 and 0.06.
TEST(SensorStates, ATimeOffsetIsEstimatedConsistently) {
  const std::string text = Late("{mean: 0, sigma: 0.05}");
  for (const auto& [name, nees] : MeansOf(text, "nees.mean:right", 100)) {
    EXPECT_NEAR(nees, 1.0, 0.4) << name;
  }
  for (const auto& [name, nees] : MeansOf(text, "nees.mean:target", 100)) {
    EXPECT_NEAR(nees, 1.0, 0.2) << name;
  }
}

TEST(SensorStates, ATimeOffsetOf20MsIsFound) {
  const RunResult run =
      RunOf(Late("{mean: 0, sigma: 0.05}", ", initial: {right: {time_offset: 0.02}}"));
  for (const EstimatorResult& one : run.estimators) {
    EXPECT_LT(std::abs(one.metrics.at("final_error:right.time_offset")), 0.01) << one.name;
    EXPECT_TRUE(one.unobservable.empty()) << one.name;
  }
}

// A constant offset and an estimated offset that is known exactly give equal results. Only the
// spread of the sigma points differs, because it depends on the number of states.
TEST(SensorStates, ATimeOffsetMayBeAParameter) {
  const RunResult constant = RunOf(Late("0.02")), known = RunOf(Late("{mean: 0.02, sigma: 0}"));
  for (std::size_t i = 0; i < constant.estimators.size(); ++i) {
    const double rmse = known.estimators[i].metrics.at("rmse:target.position");
    const double relative = constant.estimators[i].name == "ukf" ? 1e-6 : 1e-10;
    EXPECT_NEAR(constant.estimators[i].metrics.at("rmse:target.position"), rmse, relative * rmse)
        << constant.estimators[i].name;
  }
  const RunResult ignored = RunOf(Late("0.0",
                                       ", overrides: {sensors: {right: {time_offset_s: "
                                       "0.05}}}"));
  EXPECT_GT(ignored.estimators[0].metrics.at("nees.mean:target"), 1.5)
      << "an ignored offset of 50 ms must be noticeable";
}

// `explain` prints these names.
TEST(SensorStates, AreMovedByAModelThatIsNamedAfterItsDynamics) {
  const auto name = [](const std::string& dynamics) {
    const Experiment experiment = BuildExperiment(
        testing::Read(Filled("", "", ", dynamics: {clock_bias: " + dynamics + '}')), TheHost());
    return experiment.estimators[0].problem.motions.back().model->name();
  };
  EXPECT_EQ(name("constant"), "constant");
  EXPECT_EQ(name("{random_walk: 1}"), "random_walk");
  EXPECT_EQ(name("{gauss_markov: {sigma: 1, time_constant_s: 9}}"), "gauss_markov");
}

std::string WhyNot(const std::string& text) {
  return Message([&] { BuildExperiment(testing::Read(text), TheHost()); });
}

TEST(SensorStates, RefusesByKeyAndRemedy) {
  const auto expect = [](const std::string& text, const std::string& words) {
    const std::string why = WhyNot(text);
    EXPECT_NE(why.find(words), std::string::npos) << why;
  };
  const auto keys = [](const std::string& more) { return Filled("", "", ", " + more); };
  expect(keys("initial: {clock: {mean: 0, sigma: 1}}"), "sensors.gnss.initial.clock: unknown key");
  expect(keys("initial: {clock_bias: {from_measurement: gnss}}"),
         "cannot start from a measurement");
  expect(keys("dynamics: {clock_bias: {random_walk: -1}}"), "negative");
  expect(keys("dynamics: {clock_bias: {walk: 1}}"), "dynamics.clock_bias.walk: unknown key");
  expect(keys("dynamics: {clock_bias: {}}"), "needs exactly one kind of dynamics");
  expect(keys("dynamics: {clock_bias: {gauss_markov: {sigma: 1, time_constant_s: 0}}}"),
         "time_constant_s");
  expect(keys("consider: [position]"), "this entry has no block 'position'");
  expect(keys("consider: [clock_bias], constant: [clock_bias]"), "a constant has no uncertainty");
  expect(Filled("  gnss: {model: constant, blocks: {value: clock_bias}, initial: {clock_bias: "
                "{mean: 0, sigma: 1}}}\n",
                "", ""),
         "the sensor owns the state 'gnss.clock_bias', but a state entry has the same name as the "
         "sensor");
  expect(keys("dynamics: {clock_bias: brownian}"), "expected constant, {random_walk: SIGMA}");
  expect(keys("constant: [clock_bias], initial: {clock_bias: {mean: 1}}, dynamics: {clock_bias: "
              "{random_walk: 1}}"),
         "'clock_bias' is constant");
  expect(Late("100"), "at most 60 s");
  expect(Late("{mean: 0, sigma: 1e9}"), "at most 60 s");
  std::string still = Late("0.02");
  still.replace(
      still.find("model: constant_velocity, noise: {kind: continuous, acceleration: 0.4},"), 71,
      "model: constant, blocks: {value: position},");
  still.replace(still.find(", velocity: {mean: -3, sigma: 0.2}"), 34, "");
  expect(still, "sensors.right.time_offset_s: no motion model changes the blocks of this sensor");
  std::string unknown = Filled("", "", "");
  const std::size_t at = unknown.find("known:");
  unknown.replace(at, unknown.find("]]") + 2 - at, "missing: 0.5");
  expect(unknown, "source.sensors.gnss.known: missing");
  std::string other = Filled("", "", "");
  other.replace(other.find("[2e7, 0, 1e7]"), 13, "[2e7, 0]");
  expect(other, "known");
}

}  // namespace
}  // namespace alidade
