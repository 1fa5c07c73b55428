// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/config/config.h"
#include "support/program.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::Arguments;
using testing::Contains;
using testing::Outcome;
using Cli = testing::ProgramTest;

TEST_F(Cli, HelpNamesEveryCommandAndExitsWithZero) {
  const Outcome help = Call({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.err, "");
  for (const char* command : {"run", "explain", "sweep", "plugins", "eval", "doctor"}) {
    EXPECT_TRUE(Contains(help.out, std::string("\n  ") + command + ' ')) << command;
    const Outcome one = Call({command, "--help"});
    EXPECT_EQ(one.code, 0) << command;
    EXPECT_TRUE(Contains(one.out, "Usage: alidade " + std::string(command))) << one.out;
    EXPECT_TRUE(Contains(one.out, "--help")) << one.out;
  }
}

// Words for commands that other programs use.
TEST_F(Cli, HelpVersionAndListAreCommands) {
  EXPECT_EQ(Call({"help"}).out, Call({"--help"}).out);
  EXPECT_EQ(Call({"help", "run"}).out, Call({"run", "--help"}).out);
  EXPECT_EQ(Call({"help", "run"}).code, 0);
  EXPECT_EQ(Call({"version"}).out, Call({"--version"}).out);
  EXPECT_EQ(Call({"list"}).out, Call({"plugins", "list"}).out);
  EXPECT_FALSE(Call({"list"}).out.empty());
}

TEST_F(Cli, UsageErrorsExitWithTwoAndNameHelp) {
  const Outcome mistyped = Call({"rnu"});
  EXPECT_EQ(mistyped.code, 2);
  EXPECT_EQ(mistyped.err,
            "error: unknown command 'rnu'; did you mean 'run'?\nsee `alidade --help`\n");
  EXPECT_EQ(mistyped.out, "");

  EXPECT_EQ(Call({}).err, "error: a command is missing\nsee `alidade --help`\n");
  EXPECT_EQ(Call({"run", "config.yaml", "--forec"}).err,
            "error: unknown option '--forec'; did you mean '--force'?\nsee `alidade run --help`\n");
  EXPECT_EQ(Call({"plugins", "info"}).err,
            "error: the argument NAME is missing (name of a sensor, motion model, source or "
            "estimator)\nsee `alidade plugins info --help`\n");
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs"}).err,
            "error: the option --runs needs a value (total number of runs, over all shards)\nsee "
            "`alidade sweep --help`\n");
  for (const Arguments& bad : {Arguments{},
                               {"run"},
                               {"run", "a", "b"},
                               {"run", "a", "--set", "no_value"},
                               {"run", "a", "--seed", "-1"},
                               {"run", ""},
                               {"run", "config.yaml", "-o", ""},
                               {"run", "config.yaml", "--plugin-path", ""},
                               {"sweep", "config.yaml", "--runs", "1", "--output="},
                               {"plugins", "list", "--plugin-path="},
                               {"plugins"},
                               {"plugins", "lst"},
                               {"simulate"},
                               {"simulate", "a", "--seed", "-1"},
                               {"compare"},
                               {"bundle"},
                               {"explain"},
                               {"check"},
                               {"eval"},
                               {"doctor", "a"},
                               {"sweep", "config.yaml", "--runs", "2", "--vary", "source.seed"},
                               {"sweep", "a"},
                               {"sweep", "a", "--runs", "0"},
                               {"sweep", "a", "--runs", "4", "--shard", "5/4"}}) {
    const Outcome outcome = Call(bad);
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("error: ")) << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, "\nsee `alidade")) << outcome.err;
    EXPECT_TRUE(outcome.err.ends_with(" --help`\n")) << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
}

TEST_F(Cli, AnOptionWithOneValueIsRefusedIfItIsRepeated) {
  const Outcome seeds = Call({"run", "config.yaml", "--seed", "1", "--seed", "2"});
  EXPECT_EQ(seeds.code, 2);
  EXPECT_EQ(seeds.err,
            "error: the option --seed is given more than once (seed of the source; replaces the "
            "seed in the config)\nsee `alidade run --help`\n");
  const Outcome folders = Call({"run", "config.yaml", "-o", "a", "--output=b"});
  EXPECT_EQ(folders.code, 2);
  EXPECT_TRUE(Contains(folders.err, "the option --output is given more than once")) << folders.err;
  EXPECT_FALSE(Exists("a") || Exists("b"));
}

// A flag has no value, so a repetition has no effect. The last value of a key is used.
TEST_F(Cli, FlagsAndSettingsMayBeRepeated) {
  const Outcome run = Call({"run", "config.yaml", "-o", "out", "--all", "--all", "--quiet",
                            "--quiet", "--set", "source.seed=5", "--set", "source.seed=6"});
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(Contains(Read("out/config.resolved.yaml"), "seed: 6")) << run.err;
  EXPECT_FALSE(Contains(Read("out/config.resolved.yaml"), "seed: 5"));
}

TEST_F(Cli, UnderscoresInTheNameOfAnOptionMeanHyphens) {
  EXPECT_EQ(Call({"run", "config.yaml", "-o", "a", "--allow_outside",
                  "--plugin_path=" ALIDADE_BINARY_DIR "/lib/alidade/plugins"})
                .code,
            0);
  // Underscores become hyphens in option names only, not in option values. The record contains the
  // command line as the user entered it.
  EXPECT_EQ(Call({"run", "config.yaml", "--output=b_c", "--allow_outside",
                  "--set=source.sigma_disparity_px=0"})
                .code,
            0);
  EXPECT_TRUE(Exists("b_c/run.json"));
  EXPECT_TRUE(Contains(Read("b_c/config.resolved.yaml"), "sigma_disparity_px: 0"));
  EXPECT_TRUE(Contains(Read("b_c/timing.json"), "--allow_outside"));
  // Arguments after `--` are not options.
  Write("--my_config.yaml", testing::kDepthConfig);
  EXPECT_EQ(Call({"run", "-o", "d", "--", "--my_config.yaml"}).code, 0);
}

TEST_F(Cli, VersionIsOneLine) {
  const Outcome version = Call({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out, "alidade 0.1.0\n");
}

TEST_F(Cli, RunPrintsTheComparisonAndWhereItWrote) {
  const Outcome run = Call({"run", "config.yaml"});
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(Contains(run.out, "rmse target.depth [mm]")) << run.out;
  EXPECT_TRUE(Contains(run.out, "\nreport   runs/config/report.html\n")) << run.out;
  // If standard error is not a terminal, the program prints neither progress nor colour.
  EXPECT_EQ(run.err, "");
  EXPECT_EQ(Json("runs/config/run.json").root().At("status").Text(), "ok");
  EXPECT_EQ(Call({"run", "config.yaml", "--force", "--quiet"}).out, "");
}

TEST_F(Cli, SetAndSeedReplaceKeysOfTheConfig) {
  const auto rmse = [&](const Arguments& more) {
    Arguments all = {"run", "config.yaml", "-o", "out", "--force"};
    all.insert(all.end(), more.begin(), more.end());
    EXPECT_EQ(Call(all).code, 0);
    const Config record = Json("out/run.json");
    const Node metrics = record.root().At("estimators").At("ekf").At("metrics");
    return metrics.At("rmse:target.depth").Number();
  };
  const double base = rmse({});
  EXPECT_EQ(rmse({"--seed", "1"}), base);
  EXPECT_NE(rmse({"--seed", "2"}), base);
  EXPECT_EQ(rmse({"--set", "source.seed=2"}), rmse({"--seed", "2"}));
  // Without noise in the data the error of the depth is smaller.
  EXPECT_LT(rmse({"--set", "source.sigma_disparity_px=0", "--set=source.sigma_edge_px=0"}), base);
  EXPECT_TRUE(Contains(Read("out/config.resolved.yaml"), "sigma_disparity_px: 0"));
}

TEST_F(Cli, ConfigErrorsHavePlaceAndRemedy) {
  const Outcome range = Call({"run", "config.yaml", "--set", "sensors.stereo.focal_px=-1"});
  EXPECT_EQ(range.code, 78);
  EXPECT_TRUE(range.err.starts_with("error: --set sensors.stereo.focal_px: ")) << range.err;
  Write("config.yaml", "estimtors: {}\n" + testing::kDepthConfig);
  const Outcome unknown = Call({"run", "config.yaml"});
  EXPECT_EQ(unknown.code, 78);
  EXPECT_TRUE(unknown.err.starts_with("error: config.yaml:1:1 estimtors: ")) << unknown.err;
  EXPECT_TRUE(Contains(unknown.err, "did you mean 'estimators'?")) << unknown.err;
  EXPECT_FALSE(Exists("runs"));
  Write("config.yaml", testing::kDepthConfig);
  const Outcome include = Call({"run", "config.yaml", "--set", "include=x.yaml"});
  EXPECT_EQ(include.code, 78);
  EXPECT_TRUE(include.err.starts_with("error: --set include: cannot be set, because files"));
  const Outcome nameless = Call({"run", "config.yaml", "--set", "plugins=['']"});
  EXPECT_EQ(nameless.code, 78);
  EXPECT_TRUE(nameless.err.starts_with("error: --set plugins[0]: the path is empty"))
      << nameless.err;

  EXPECT_EQ(Call({"run", "missing.yaml"}).code, 66);
  Write("table.csv", "t_s,d\n0,80\n");
  const Outcome model =
      Call({"run", "table.yaml", "--set", "sensors.stereo.model=stereo_disparty"});
  EXPECT_EQ(model.code, 69);
  EXPECT_TRUE(Contains(model.err, "did you mean stereo_disparity?") ||
              Contains(model.err, "did you mean 'stereo_disparity'?"))
      << model.err;
  EXPECT_FALSE(Contains(model.err, "\n  searched ")) << model.err;
}

TEST_F(Cli, UntrustedPluginIsRefusedWithSeventySeven) {
  const fs::path plugin = folder_ / "alidade_constant.so";
  fs::copy_file(ALIDADE_BINARY_DIR "/lib/alidade/plugins/alidade_constant.so", plugin);
  fs::permissions(plugin, fs::perms::all);
  const Outcome run = Call({"run", "config.yaml", "--plugin-path", "alidade_constant.so"});
  EXPECT_EQ(run.code, 77) << run.err;
  EXPECT_TRUE(Contains(run.err, plugin.string())) << run.err;
  EXPECT_EQ(Call({"plugins", "list", "--plugin-path", plugin.string()}).code, 77);
  // These commands report the refused plugin and continue with the others.
  const Outcome where = Call({"plugins", "where", "--plugin-path", "alidade_constant.so"});
  EXPECT_EQ(where.code, 0) << where.err;
  EXPECT_TRUE(Contains(where.out,
                       plugin.string() + " (config or command line): 0 entries found, 1 refused\n"))
      << where.out;
  EXPECT_TRUE(Contains(where.out, "refused " + plugin.string() + ": not trusted")) << where.out;
  EXPECT_TRUE(Contains(where.out, "(next to the program): ")) << where.out;
  const Outcome nowhere = Call({"plugins", "where", "--plugin-path", "none.so"});
  EXPECT_TRUE(Contains(nowhere.out, "/none.so (config or command line): does not exist\n"))
      << nowhere.out;
  const Outcome doctor = Call({"doctor", "--plugin-path", "alidade_constant.so"});
  EXPECT_TRUE(Contains(doctor.out, "warn  plugin " + plugin.string())) << doctor.out;
}

TEST_F(Cli, BadDataEndsTheRunAndLeavesARecord) {
  Write("table.csv", "t_s,d\n0,80\n0.1,81\n0.2,eighty\n");
  const Outcome run = Call({"run", "table.yaml"});
  EXPECT_EQ(run.code, 65);
  EXPECT_TRUE(Contains(run.err, "table.csv:4:5 d: 'eighty'")) << run.err;
  const Config record = Json("runs/table/run.json");
  EXPECT_EQ(record.root().At("status").Text(), "failed");
  EXPECT_TRUE(Contains(record.root().At("reason").Text(), "eighty"));
  EXPECT_TRUE(Contains(Read("runs/table/ekf/estimates.csv"), "\n0.1"));
}

TEST_F(Cli, DivergenceEndsTheRunWhereAsked) {
  const Outcome reported = Call(Diverging({"run", "config.yaml"}));
  EXPECT_EQ(reported.code, 0);
  EXPECT_TRUE(Contains(reported.out, "\ndiverged  ekf: ")) << reported.out;
  const Outcome failed = Call(
      Diverging({"run", "config.yaml", "--force", "--set", "estimators.ekf.on_divergence=fail"}));
  EXPECT_EQ(failed.code, 79);
  EXPECT_TRUE(Contains(failed.err, "error: estimator 'ekf' at t = ")) << failed.err;
  EXPECT_EQ(Json("runs/config/run.json").root().At("status").Text(), "failed");
}

// Tests fault 89 of tests/faults/README.md.
TEST_F(Cli, OutputThatCannotBeWrittenIsSeventyFour) {
  const Outcome full = Call({"run", "config.yaml"}, "/dev/full");
  EXPECT_EQ(full.code, 74);
  EXPECT_TRUE(Contains(full.err, "error: <stdout>: cannot write")) << full.err;
  EXPECT_EQ(Json("runs/config/run.json").root().At("status").Text(), "ok");
  EXPECT_EQ(Call({"plugins", "list"}, "/dev/full").code, 74);
  EXPECT_EQ(Call({"--version"}, "/dev/full").code, 74);
}

/// Starts a run that reads a pipe. The test writes to the other end of the pipe.
class PipedRun : public testing::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    ASSERT_EQ(::mkfifo((folder_ / "table.csv").c_str(), 0600), 0);
    pipe_ = ::open((folder_ / "table.csv").c_str(), O_RDWR | O_CLOEXEC);
    Feed("t_s,d\n0,80\n0.1,81\n0.2,82\n");
    run_ = Start({"run", "table.yaml", "--follow", "-o", "out"});
    ASSERT_TRUE(Eventually([&] { return Contains(Read("stdout"), "\"t_s\":0.2,"); }));
  }
  void TearDown() override {
    ::close(pipe_);
    ProgramTest::TearDown();
  }
  void Feed(const std::string& rows) const {
    ASSERT_EQ(::write(pipe_, rows.data(), rows.size()), static_cast<ssize_t>(rows.size()));
  }
  int pipe_ = -1;
  pid_t run_ = -1;
};

// Tests fault 90 of tests/faults/README.md.
TEST_F(PipedRun, StopsAtASignalWithAllThatIsDone) {
  ::kill(run_, SIGINT);
  Feed("0.3,83\n");  // If a signal arrives just before the run waits for input, the run handles it
                     // at the next row.
  const Outcome run = Wait(run_);
  EXPECT_EQ(run.code, 75) << run.err;
  const Config record = Json("out/run.json");
  EXPECT_EQ(record.root().At("status").Text(), "stopped");
  const Node counts = record.root().At("estimators").At("ekf").At("counts");
  EXPECT_GE(counts.At("accepted:stereo").Number(), 3);
  EXPECT_TRUE(Contains(Read("out/ekf/estimates.csv"), "\n0.2"));
  EXPECT_FALSE(Exists("out.partial"));
}

// Tests fault 90 of tests/faults/README.md.
TEST_F(PipedRun, EndsAtOnceAtTheSecondSignal) {
  ::kill(run_, SIGSTOP);
  ::kill(run_, SIGTERM);
  ::kill(run_, SIGINT);
  ::kill(run_, SIGCONT);
  const Outcome run = Wait(run_);
  EXPECT_NE(run.signal, 0) << run.err;
  EXPECT_FALSE(Exists("out"));
  EXPECT_EQ(Json("out.partial/run.json").root().At("status").Text(), "running");
}

TEST_F(Cli, StopsAtASignalWhileNobodyWritesToThePipe) {
  ASSERT_EQ(::mkfifo((folder_ / "table.csv").c_str(), 0600), 0);
  const pid_t run = Start({"run", "table.yaml", "-o", "out"});
  // The run has a handler for SIGINT (bit 1 of the mask) and waits in the call that opens the pipe.
  const auto waits = [&] {
    const std::string status = testing::ReadText("/proc/" + std::to_string(run) + "/status");
    const std::size_t caught = status.find("SigCgt:\t");
    return caught != std::string::npos && Contains(status, "\nState:\tS") &&
           (std::stoull(status.substr(caught + 8), nullptr, 16) & 2) != 0;
  };
  ASSERT_TRUE(Eventually(waits));
  ::kill(run, SIGINT);
  siginfo_t ended{};
  const auto has_ended = [&] {
    return ::waitid(P_PID, static_cast<id_t>(run), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == run;
  };
  if (!Eventually(has_ended)) ::kill(run, SIGKILL);
  const Outcome stopped = Wait(run);
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_TRUE(Contains(stopped.err, "table.csv: stopped by a signal while waiting")) << stopped.err;
  EXPECT_FALSE(Exists("out"));
}

TEST_F(Cli, TimingHasTheWholeCommand) {
  const Arguments arguments = {"run", "config.yaml", "--set=title=it's a \"run\""};
  EXPECT_EQ(Call(arguments).code, 0);
  EXPECT_EQ(Json("runs/config/timing.json").root().At("command").Text(),
            "alidade run config.yaml '--set=title=it'\\''s a \"run\"'");
}

TEST_F(Cli, StopsBetweenFramesAtASignal) {
  // A run over 300000 frames takes seconds.
  const pid_t run = Start({"run", "config.yaml", "-o", "out", "--set", "source.duration_s=10000"});
  ASSERT_TRUE(Eventually([&] { return Exists("out.partial/ekf/estimates.csv"); }));
  ::kill(run, SIGTERM);
  const Outcome stopped = Wait(run);
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_TRUE(stopped.err.starts_with("stopped after ")) << stopped.err;
  EXPECT_EQ(Json("out/run.json").root().At("status").Text(), "stopped");
}

// The program ignores SIGHUP if it was started with SIGHUP ignored, as nohup does. If SIGHUP were
// counted, SIGTERM would be the second signal and would end the run at once.
TEST_F(Cli, AHangUpThatIsIgnoredStopsNothing) {
  before_ = "trap '' HUP";
  const pid_t run = Start({"run", "config.yaml", "-o", "out", "--set", "source.duration_s=10000"});
  ASSERT_TRUE(Eventually([&] { return Exists("out.partial/ekf/estimates.csv"); }));
  ::kill(run, SIGHUP);
  ::kill(run, SIGTERM);
  const Outcome stopped = Wait(run);
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_EQ(Json("out/run.json").root().At("status").Text(), "stopped");
}

TEST_F(Cli, PluginsTellsNamesUnitsRangesAndDefaults) {
  const Outcome list = Call({"plugins", "list"});
  EXPECT_EQ(list.code, 0);
  for (const char* name : {"constant", "stereo_disparity", "depth_target", "square_root_ekf"}) {
    EXPECT_TRUE(Contains(list.out, name)) << list.out;
  }
  EXPECT_FALSE(Contains(list.out, ".so")) << list.out;
  EXPECT_FALSE(Contains(list.out, "built in")) << list.out;
  const Outcome with_files = Call({"plugins", "list", "-v"});
  EXPECT_TRUE(Contains(with_files.out, "/alidade_tables.so\n")) << with_files.out;
  EXPECT_TRUE(Contains(with_files.out, "  built in\n")) << with_files.out;
  const Outcome info = Call({"plugins", "info", "stereo_disparity"});
  EXPECT_EQ(info.code, 0);
  for (const char* part : {"role depth: vector(1), m", "measurement disparity: vector(1), px",
                           "focal_px", "required", "min_range_m", ">= 0", "[Ekf2017]"}) {
    EXPECT_TRUE(Contains(info.out, part)) << part << '\n' << info.out;
  }
  const Outcome scale = Call({"plugins", "info", "scale_2d"});
  EXPECT_TRUE(Contains(scale.out, "propagated | constant")) << scale.out;
  EXPECT_TRUE(Contains(scale.out, "noise_model = constant")) << scale.out;

  const Outcome ekf = Call({"plugins", "info", "ekf"});
  for (const char* part :
       {"ekf: estimator", "(0, 1) or none", "joint | per_sensor | per_measurement",
        "rejection_recovery.after", "[1, 1e+06]", "inf", "on_divergence"}) {
    EXPECT_TRUE(Contains(ekf.out, part)) << part << '\n' << ekf.out;
  }
  EXPECT_TRUE(Contains(ekf.out, "state, sensors, landmarks and initial_time_s for this estimator"));
  EXPECT_TRUE(Contains(Call({"plugins", "info", "ekf", "--json"}).out, "\"estimator\""));
  const Outcome iekf = Call({"plugins", "info", "iekf"});
  for (const char* part : {"iekf: estimator", "max_iterations", "[2, 1000]", "tolerance"}) {
    EXPECT_TRUE(Contains(iekf.out, part)) << part << '\n' << iekf.out;
  }

  for (const std::string type : {"rts", "square_root_ekf", "ukf"}) {
    const Outcome estimator = Call({"plugins", "info", type});
    EXPECT_TRUE(Contains(estimator.out, type + ": estimator")) << estimator.out;
    EXPECT_TRUE(Contains(estimator.out, "max_dt_s")) << estimator.out;
    EXPECT_EQ(Contains(estimator.out, "kappa"), type == "ukf") << estimator.out;
    EXPECT_TRUE(Contains(estimator.out, "rejection_recovery.after_s")) << estimator.out;
  }

  const Outcome missing = Call({"plugins", "info", "stereo_disparit"});
  EXPECT_EQ(missing.code, 69);
  EXPECT_TRUE(Contains(missing.err, "stereo_disparity")) << missing.err;
  const Outcome where = Call({"plugins", "where"});
  EXPECT_EQ(where.code, 0);
  EXPECT_TRUE(Contains(where.out, "lib/alidade/plugins (next to the program)")) << where.out;
}

TEST_F(Cli, PluginsPrintsJson) {
  // Every JSON text is valid YAML, so Config can parse it.
  const auto parse = [](const std::string& json) {
    return Config::FromText("list:\n  " + json, "json");
  };
  const Config info = parse(Call({"plugins", "info", "depth_target", "--json"}).out);
  const Node entry = info.root().At("list").Items().at(0);
  EXPECT_EQ(entry.At("kind").Text(), "source");
  const std::vector<Node> parameters = entry.At("parameters").Items();
  const auto depth = std::find_if(parameters.begin(), parameters.end(), [](const Node& node) {
    return node.At("key").Text() == "depth_mean_m";
  });
  ASSERT_NE(depth, parameters.end());
  EXPECT_EQ(depth->At("unit").Text(), "m");
  EXPECT_EQ(depth->At("default").Text(), "0.3");
  const Config list = parse(Call({"plugins", "list", "--json"}).out);
  EXPECT_GE(list.root().At("list").Items().size(), 6u);
}

TEST_F(Cli, DoctorFindsThisBuildHealthy) {
  const Outcome doctor = Call({"doctor"});
  EXPECT_EQ(doctor.code, 0) << doctor.out;
  EXPECT_FALSE(Contains(doctor.out, "\nfail")) << doctor.out;
  EXPECT_TRUE(Contains(doctor.out, "ok    alidade 0.1.0\n")) << doctor.out;
  EXPECT_TRUE(Contains(doctor.out, "yaml-cpp 0.")) << doctor.out;
}

TEST_F(Cli, DoctorTellsWhetherTheBatchIsBuilt) {
  const bool is_built =
      fs::exists(ALIDADE_BINARY_DIR "/lib/alidade/plugins/alidade_ceres_batch.so");
  const Outcome doctor = Call({"doctor"});
  EXPECT_EQ(Contains(doctor.out, "ok    batch estimator: ceres_batch\n"), is_built) << doctor.out;
  EXPECT_EQ(
      Contains(doctor.out,
               "warn  the batch estimator is not built: filters cannot be compared with a "
               "batch\n      remedy: apt-get install libceres-dev, then configure and build all "
               "targets\n"),
      !is_built)
      << doctor.out;
}

}  // namespace
}  // namespace alidade
