// SPDX-License-Identifier: Apache-2.0
//
// Creates the filter of a config for live use and compares it with a run of the same config.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "alidade/experiment/experiment.h"
#include "alidade/experiment/make_filter.h"

namespace alidade {
namespace {

Config Example(const std::string& path) {
  return Config::FromFile(std::string(ALIDADE_SOURCE_DIR) + "/examples/" + path);
}

TEST(MakeFilter, IsTheFilterOfTheRun) {
  const Config config = Example("05_depth_principled/config.yaml");
  const PluginHost host;
  const auto filter = MakeFilter(config, host, "ekf");
  Experiment experiment = BuildExperiment(config, host);
  Estimator& run = *experiment.estimators[0].estimator;
  const std::vector<StreamInfo>& streams = experiment.source->streams();
  SourceFrame frame;
  int frames = 0;
  for (; frames < 60 && experiment.source->Next(frame); ++frames) {
    std::vector<Reading> readings;
    for (const Measurement& m : frame.measurements) {
      const std::string& name = streams[static_cast<std::size_t>(m.stream)].name;
      if (name == "disparity" || name == "inverse_scale") {
        readings.push_back({filter->stream(name), m.values});
      }
    }
    filter->Push(frame.timestamp, readings);
    run.Process(frame);
    ASSERT_EQ(filter->state().values(), run.state().values()) << frames;
    ASSERT_EQ(filter->state().covariance().Dense(), run.state().covariance().Dense()) << frames;
  }
  EXPECT_EQ(frames, 60);
}

TEST(MakeFilter, NeedsNoSource) {
  const Config config = Config::FromText(R"(
alidade: 1
state:
  target:
    model: constant_velocity
    noise: {kind: continuous, acceleration: 1.0}
    initial: {position: {mean: 0.3, sigma: 0.1}, velocity: {mean: 0, sigma: 0.5}}
sensors:
  stereo:
    {model: stereo_disparity, stream: left, roles: {depth: target.position}, focal_px: 400,
     baseline_m: 0.065, sigma_px: 1.0}
estimators:
  alone: {type: iekf, gate: 0.99}
  late: {type: rts}
  other: {type: ekf, overrides: {sensors: {stereo: {stream: right}}}}
)",
                                         "live.yaml");
  const PluginHost host;
  const auto filter = MakeFilter(config, host, "alone");
  filter->Push(0, {{filter->stream("left"), {80.0}}});
  EXPECT_LT(filter->state().sigma(filter->block("target.position")), 0.02);
  const auto refusal = [&](const char* name) -> std::string {
    try {
      MakeFilter(config, host, name);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(MakeFilter(config, host, "other")->stream("right"), 0);
  EXPECT_NE(refusal("late").find("'rts' is not a recursive filter"), std::string::npos);
  EXPECT_NE(refusal("late").find("live.yaml:14"), std::string::npos) << refusal("late");
  EXPECT_NE(refusal("deep").find("estimators.deep"), std::string::npos) << refusal("deep");
}

TEST(MakeFilter, RefusesAnInvariantError) {
  const Config config = Example("34_invariant_error/config.yaml");
  const PluginHost host;
  EXPECT_NO_THROW(MakeFilter(config, host, "ekf"));
  try {
    MakeFilter(config, host, "invariant");
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadConfig);
    const std::string text = e.what();
    EXPECT_NE(text.find("estimators.invariant.invariant_error: a filter for live use cannot have "
                        "an invariant error; remove this key"),
              std::string::npos)
        << text;
  }
}

}  // namespace
}  // namespace alidade
