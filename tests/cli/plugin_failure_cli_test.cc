// SPDX-License-Identifier: Apache-2.0
//
// Tests models that throw or return an error in the middle of a run.
#include "support/program.h"

namespace alidade::testing {
namespace {

class PluginFailureCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (!fs::exists(Plugin("bad_models"))) {
      GTEST_SKIP() << "this plugin is built only together with test_plugins";
    }
    Write("rows.csv", "t_s,u,v\n0,1,1\n1,1,1\n");
  }
  static std::string Plugin(const std::string& name) {
    return ALIDADE_BINARY_DIR "/tests/plugins/" + name + ".so";
  }
};

// Tests fault 58 of tests/faults/README.md.
TEST_F(PluginFailureCli, AnExceptionOfAPluginInCIsNamedAndNoEndOfTheProgram) {
  const std::string plugin = Plugin("raw_throws");
  Write("probe.yaml", R"(alidade: 1
plugins: [)" + plugin + R"(]
state: {s: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}}
sensors: {bad: {model: throws_in_eval, stream: z, roles: {x: s.value}}}
source: {type: tables, path: rows.csv, streams: {z: u}}
estimators: {ekf: {type: ekf}}
)");
  const auto run = [&](const std::string& key, const std::string& value) {
    return Call({"run", "probe.yaml", "-o", "out", "--force", "--set", key + '=' + value});
  };
  const std::string words =
      "Predict of model 'throws_in_eval' of plugin " + plugin + " threw: the dog ate it";
  EXPECT_EQ(run("estimators.ekf.on_plugin_failure", "skip").code, 0);
  EXPECT_TRUE(Contains(Read("out/ekf/events.csv"), words)) << Read("out/ekf/events.csv");
  const Outcome ended = run("estimators.ekf.on_plugin_failure", "abort");
  EXPECT_EQ(ended.code, 69) << ended.err;
  EXPECT_TRUE(Contains(ended.err, words)) << ended.err;
  const Outcome shifted = Call(
      {"run", "probe.yaml", "-o", "out", "--force", "--set",
       "state.s={model: constant_velocity, noise: {kind: continuous, acceleration: 1}, "
       "initial: {position: {mean: 1, sigma: 1}, velocity: {mean: 0, sigma: 1}}}",
       "--set", "sensors.bad.roles={x: s.position}", "--set", "sensors.bad.time_offset_s=0.01"});
  ASSERT_EQ(shifted.code, 0) << shifted.err;
  EXPECT_TRUE(Contains(Read("out/ekf/events.csv"), words)) << Read("out/ekf/events.csv");
  // Two models throw in the same frame. The program reads their messages only after both have
  // thrown.
  const std::string two = "{model: throws_in_valid, stream: z, roles: {x: s.value}}";
  ASSERT_EQ(run("sensors", "{bad: " + two + ", worse: " + two + '}').code, 0);
  for (const std::string sensor : {"bad", "worse"}) {
    EXPECT_TRUE(Contains(Read("out/ekf/events.csv"),
                         "sensor '" + sensor + "': Valid of model 'throws_in_valid' of plugin " +
                             plugin + " threw: an exception of unknown type"))
        << Read("out/ekf/events.csv");
  }
  const Outcome created = run("sensors.bad.model", "throws_in_create");
  EXPECT_EQ(created.code, 69) << created.err;
  EXPECT_TRUE(Contains(created.err, "model 'throws_in_create' of plugin " + plugin +
                                        " could not be created: it threw: the dog ate it"))
      << created.err;
  const Outcome destroyed = run("sensors.bad.model", "throws_in_destroy_too");
  EXPECT_EQ(destroyed.code, 0) << destroyed.err;
  EXPECT_TRUE(Contains(destroyed.err, "warning: function destroy of model 'throws_in_destroy_too'"))
      << destroyed.err;
  const Outcome step =
      run("state.s",
          "{model: throws_in_step, blocks: {x: value}, initial: {value: {mean: 1, sigma: 1}}}");
  EXPECT_EQ(step.code, 79) << step.err;
  EXPECT_TRUE(Contains(step.err, "Step of model 'throws_in_step' of plugin " + plugin + " threw: "))
      << step.err;
}

// Tests fault 58 of tests/faults/README.md.
TEST_F(PluginFailureCli, ASensorThatFailsIsLeftOutOnceOrAltogetherOrEndsTheRun) {
  const std::string plugin = Plugin("bad_models");
  Write("bad.yaml", R"(alidade: 1
plugins: [)" + plugin + R"(]
state:
  s: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}
  t: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}
sensors: {bad: {model: throws_in_noise, stream: z, roles: {x: s.value, y: t.value}}}
source: {type: tables, path: rows.csv, streams: {z: [u, v]}}
estimators: {ekf: {type: ekf}}
)");
  const auto policy = [&](const std::string& name) {
    return Call({"run", "bad.yaml", "-o", "out", "--force", "--set",
                 "estimators.ekf.on_plugin_failure=" + name});
  };
  EXPECT_EQ(policy("skip").code, 0);
  const auto failures = [&] {
    const std::string rows = Read("out/ekf/innovations.csv");
    int count = 0;
    for (std::size_t at = 0; (at = rows.find(",failed,", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  EXPECT_EQ(failures(), 2);
  EXPECT_FALSE(Contains(Read("out/ekf/events.csv"), "sensor_disabled"));
  EXPECT_EQ(policy("disable").code, 0);
  EXPECT_EQ(failures(), 1);
  EXPECT_TRUE(Contains(Read("out/ekf/events.csv"), "sensor 'bad' has failed; its stream 'z'"));
  const Outcome ended = policy("abort");
  EXPECT_EQ(ended.code, 69);
  EXPECT_TRUE(Contains(ended.err,
                       "error: estimator 'ekf' at t = 0.000000 s: sensor 'bad', model "
                       "'throws_in_noise' of plugin " +
                           plugin + ", failed: "))
      << ended.err;
}

}  // namespace
}  // namespace alidade::testing
