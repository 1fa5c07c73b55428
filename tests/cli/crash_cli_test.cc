// SPDX-License-Identifier: Apache-2.0
//
// A model ends the process in the middle of a run.
#include <csignal>

#include "support/program.h"
#include "support/sanitized.h"

namespace alidade::testing {
namespace {

class CrashCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (kSanitized) GTEST_SKIP() << "a sanitizer ends such a process in its own way";
    if (!fs::exists(kPlugin)) GTEST_SKIP() << "built for test_plugins";
    Write("rows.csv", "t_s,u,v\n0,1,1\n1,1,1\n");
  }
  /// Runs a model of tests/faults/plugins/bad_models.cc.
  void WriteConfig(const std::string& model) const {
    Write("bad.yaml", R"(alidade: 1
plugins: [)" + kPlugin + R"(]
state:
  s: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}
  t: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}
sensors:
  bad: {model: )" + model +
                          R"(, stream: z, roles: {x: s.value, y: t.value}}
source: {type: csv, path: rows.csv, streams: {z: [u, v]}}
estimators: {ekf: {type: ekf}}
)");
  }
  Outcome RunModel(const std::string& model, const std::vector<std::string>& options = {}) const {
    WriteConfig(model);
    std::vector<std::string> line{"run", "bad.yaml", "-o", "out", "--no-figures"};
    line.insert(line.end(), options.begin(), options.end());
    return Call(line);
  }
  /// The hidden folder of a run to `out`, without its process.
  std::string Partial() const { return (fs::canonical(folder_) / ".out.partial-").string(); }
  static std::string Plugin(const std::string& name) {
    return ALIDADE_BINARY_DIR "/tests/plugins/" + name + ".so";
  }
  /// A config whose only sensor is a model of that plugin, of tests/faults/plugins, for one role.
  void WriteProbe(const std::string& plugin, const std::string& model) const {
    Write("probe.yaml", R"(alidade: 1
plugins: [)" + Plugin(plugin) +
                            R"(]
state: {s: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}}
sensors: {bad: {model: )" + model +
                            R"(, stream: z, roles: {x: s.value}}}
source: {type: csv, path: rows.csv, streams: {z: u}}
estimators: {ekf: {type: ekf}}
)");
  }
  /// The words of a crash in that call of a model.
  void ExpectCrash(const Arguments& line, const std::string& call,
                   const std::string& plugin = Plugin("bad_models")) const {
    const Outcome outcome = Call(line);
    EXPECT_EQ(outcome.signal, SIGSEGV) << line[0] << outcome.code;
    EXPECT_TRUE(outcome.err.starts_with("error: crashed, most likely inside a model"))
        << line[0] << outcome.err;
    EXPECT_TRUE(
        Contains(outcome.err, "the last call of a model: " + call + "' of plugin " + plugin))
        << line[0] << outcome.err;
  }
  const std::string kPlugin = ALIDADE_BINARY_DIR "/tests/plugins/bad_models.so";
};

TEST_F(CrashCli, ACrashSaysWhereToLookAndTakesItsCourse) {
  const Outcome outcome = RunModel("crashes");
  EXPECT_EQ(outcome.signal, SIGSEGV);
  EXPECT_TRUE(outcome.err.starts_with("error: crashed, most likely inside a model")) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "the last call of a model: Predict of model 'crashes'"))
      << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "; what was recorded is in " + Partial())) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "`alidade check PLUGIN`")) << outcome.err;
}

TEST_F(CrashCli, ACrashIsNamedInEveryCommand) {
  const std::string create = "Create of model 'crashes_in_create";
  WriteConfig("crashes_in_create");
  ExpectCrash({"run", "bad.yaml", "-o", "out", "--no-figures"}, create);
  ExpectCrash({"explain", "bad.yaml"}, create);
  ExpectCrash({"compare", "bad.yaml", "-o", "out"}, create);
  ExpectCrash({"plugins", "info", "crashes_in_create", "--plugin-path", kPlugin}, create);
  WriteConfig("wild_description");
  ExpectCrash({"explain", "bad.yaml"}, "Description of model 'wild_description");
  WriteConfig("crashes");
  const std::string models = "source={type: models, rate_hz: 10, duration_s: 1}";
  ExpectCrash({"simulate", "bad.yaml", "-o", "data", "--set", models}, "Predict of model 'crashes");
  ExpectCrash({"sweep", "bad.yaml", "--runs", "2", "--jobs", "1", "-o", "out", "--set", models},
              "Predict of model 'crashes");
}

// Handlers of signals need a stack of their own there.
TEST_F(CrashCli, AStackThatAThreadOfASweepUsesUpIsACrashWithWords) {
  WriteProbe("overflow", "overflows");
  ExpectCrash({"sweep", "probe.yaml", "--runs", "8", "--jobs", "2", "-o", "out", "--set",
               "source={type: models, rate_hz: 10, duration_s: 1}"},
              "Predict of model 'overflows", Plugin("overflow"));
}

// FAULTS 58
TEST_F(CrashCli, AnExceptionOfAPluginInCIsNamedAndNoEndOfTheProgram) {
  const std::string plugin = Plugin("raw_throws");
  WriteProbe("raw_throws", "throws_in_eval");
  const auto run = [&](const std::string& key, const std::string& value) {
    return Call(
        {"run", "probe.yaml", "-o", "out", "--no-figures", "--force", "--set", key + '=' + value});
  };
  const std::string words =
      "Predict of model 'throws_in_eval' of plugin " + plugin + " threw: the dog ate it";
  EXPECT_EQ(run("estimators.ekf.on_plugin_failure", "skip").code, 0);
  EXPECT_TRUE(Contains(Read("out/ekf/events.csv"), words)) << Read("out/ekf/events.csv");
  const Outcome ended = run("estimators.ekf.on_plugin_failure", "abort");
  EXPECT_EQ(ended.code, 69) << ended.err;
  EXPECT_TRUE(Contains(ended.err, words)) << ended.err;
  const Outcome shifted = Call(
      {"run", "probe.yaml", "-o", "out", "--no-figures", "--force", "--set",
       "state.s={model: constant_velocity, noise: {kind: continuous, acceleration: 1}, "
       "initial: {position: {mean: 1, sigma: 1}, velocity: {mean: 0, sigma: 1}}}",
       "--set", "sensors.bad.roles={x: s.position}", "--set", "sensors.bad.time_offset_s=0.01"});
  ASSERT_EQ(shifted.code, 0) << shifted.err;
  EXPECT_TRUE(Contains(Read("out/ekf/events.csv"), words)) << Read("out/ekf/events.csv");
  // Two in one frame, which are asked for their words once both have thrown.
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
                                        " failed while being created: it threw: the dog ate it"))
      << created.err;
  const Outcome destroyed = run("sensors.bad.model", "throws_in_destroy_too");
  EXPECT_EQ(destroyed.code, 0) << destroyed.err;
  EXPECT_TRUE(Contains(destroyed.err, "warning: Destroy of model 'throws_in_destroy_too'"))
      << destroyed.err;
  const Outcome step =
      run("state.s",
          "{model: throws_in_step, blocks: {x: value}, initial: {value: {mean: 1, sigma: 1}}}");
  EXPECT_EQ(step.code, 79) << step.err;
  EXPECT_TRUE(Contains(step.err, "Step of model 'throws_in_step' of plugin " + plugin + " threw: "))
      << step.err;
}

TEST_F(CrashCli, AnExitOfAModelIsNoSuccess) {
  for (const char* model : {"exits", "exits_at_once"}) {
    const Outcome outcome = RunModel(model);
    EXPECT_EQ(outcome.code, 69) << outcome.out;
    EXPECT_TRUE(Contains(outcome.err, "ended the process")) << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, "the last call of a model: Predict of model '" +
                                          std::string(model) + "' of plugin " + kPlugin +
                                          "; what was recorded is in " + Partial()))
        << outcome.err;
  }
}

// A process that has stopped has no watchdog.
TEST_F(CrashCli, AModelThatStopsTheProcessEndsIt) {
  const Outcome outcome = RunModel("stops_itself");
  EXPECT_EQ(outcome.code, 69) << outcome.out;
  EXPECT_TRUE(Contains(outcome.err,
                       "wanted to stop the process (SIGSTOP); the last call of a "
                       "model: Predict of model 'stops_itself' of plugin " +
                           kPlugin))
      << outcome.err;
}

// FAULTS 67
TEST_F(CrashCli, AModelThatHangsIsNamedAndWhatWasRecordedIsKept) {
  const Outcome outcome = RunModel("hangs_in_noise", {"--frame-timeout", "0.5"});
  EXPECT_EQ(outcome.code, 69) << outcome.out;
  EXPECT_TRUE(Contains(outcome.err, "error: an estimator works on one frame, after 0 others, "))
      << outcome.err;
  EXPECT_TRUE(Contains(outcome.err,
                       "for more than 0.5 s; the last call of a model: SqrtNoise of model "
                       "'hangs_in_noise' of plugin " +
                           kPlugin + "; what was recorded is in "))
      << outcome.err;
  const std::size_t at = outcome.err.find("out.failed-");
  ASSERT_NE(at, std::string::npos) << outcome.err;
  const std::string kept = outcome.err.substr(at, outcome.err.find('\n', at) - at);
  EXPECT_TRUE(Exists(kept + "/measurements.csv"));
  EXPECT_FALSE(Exists("out"));
  EXPECT_EQ(RunModel("right", {"--frame-timeout", "none"}).code, 0);
  // Before the first frame, when it is asked what can be observed.
  const Outcome at_start = RunModel("hangs", {"--frame-timeout", "0.5", "--force"});
  EXPECT_EQ(at_start.code, 69) << at_start.out;
  EXPECT_TRUE(Contains(at_start.err, "an estimator works on its start")) << at_start.err;
  EXPECT_TRUE(Contains(at_start.err, "Predict of model 'hangs'")) << at_start.err;
}

TEST_F(CrashCli, APluginThatDoesNotReturnFromCreateOrDestroyIsNamed) {
  for (const std::string call : {"Create", "Destroy"}) {
    const std::string model = call == "Create" ? "hangs_in_create" : "hangs_in_destroy";
    const std::string words =
        "; the last call of a model: " + call + " of model '" + model + "' of plugin " + kPlugin;
    const Outcome late = RunModel(model, {"--frame-timeout", "0.5", "--force"});
    EXPECT_EQ(late.code, 69) << late.out;
    EXPECT_EQ(late.err, "error: a plugin does not return, for more than 0.5 s" + words + '\n');
    const pid_t run = Start({"run", "bad.yaml", "-o", "other", "--no-figures"});
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    ::kill(run, SIGTERM);
    const Outcome stopped = Wait(run);
    EXPECT_EQ(stopped.code, 75) << stopped.err;
    EXPECT_TRUE(Contains(stopped.err, "asked to stop, but a plugin does not return" + words))
        << stopped.err;
    const pid_t sweep = Start({"sweep", "bad.yaml", "-o", "sweep", "--runs", "2", "--jobs", "1",
                               "--set", "source={type: models, rate_hz: 10, duration_s: 1}"});
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    ::kill(sweep, SIGTERM);
    const Outcome swept = Wait(sweep);
    EXPECT_EQ(swept.code, 75) << swept.err;
    EXPECT_TRUE(Contains(swept.err, "asked to stop, but a plugin does not return" + words))
        << swept.err;
  }
}

// FAULTS 58
TEST_F(CrashCli, ASensorThatFailsIsLeftOutOnceOrAltogetherOrEndsTheRun) {
  const auto policy = [&](const std::string& name) {
    return RunModel("throws_in_noise",
                    {"--set", "estimators.ekf.on_plugin_failure=" + name, "--force"});
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
                           kPlugin + ", failed: "))
      << ended.err;
}

TEST_F(CrashCli, AStopDoesNotWaitForAModelThatHangs) {
  WriteConfig("hangs_in_noise");
  const pid_t run =
      Start({"run", "bad.yaml", "-o", "out", "--no-figures", "--frame-timeout", "none"});
  const auto recording = [&] {
    return Exists(".out.partial-" + std::to_string(run) + "/measurements.csv");
  };
  ASSERT_TRUE(Eventually(recording));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ::kill(run, SIGTERM);
  const Outcome outcome = Wait(run);
  EXPECT_EQ(outcome.code, 75) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "asked to stop, but an estimator does not finish"))
      << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "SqrtNoise of model 'hangs_in_noise'")) << outcome.err;
  EXPECT_TRUE(Exists("out.failed-" + std::to_string(run))) << outcome.err;
}

TEST_F(CrashCli, AModelThatHangsEndsSweepsAndComparisonsToo) {
  WriteConfig("hangs_in_noise");
  const Arguments lines[] = {
      {"compare", "bad.yaml", "-o", "out"},
      {"sweep", "bad.yaml", "-o", "out", "--runs", "1", "--vary", "estimators.ekf.gate=0.9,0.99"}};
  for (Arguments line : lines) {
    line.insert(line.end(), {"--frame-timeout", "0.5"});
    const Outcome late = Call(line);
    EXPECT_EQ(late.code, 69) << line[0] << late.err;
    EXPECT_TRUE(Contains(late.err, "error: an estimator works on one frame, after 0 others, for"))
        << line[0] << late.err;
    EXPECT_TRUE(Contains(late.err, "SqrtNoise of model 'hangs_in_noise'")) << line[0] << late.err;
    // A comparison records one run; a sweep keeps those that are finished.
    const bool kept = Contains(late.err, "; what was recorded is in ");
    EXPECT_EQ(kept, std::string(line[0]) == "compare") << late.err;
  }
}

TEST_F(CrashCli, ARunOfAGoodModelSaysNothing) {
  const Outcome outcome = RunModel("right");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
}

}  // namespace
}  // namespace alidade::testing
