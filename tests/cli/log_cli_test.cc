// SPDX-License-Identifier: Apache-2.0
//
// Tests the messages that the program prints and writes while it runs.
#include "support/program.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;

class LogCli : public testing::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    ::unsetenv("ALIDADE_LOG");
  }
  void TearDown() override { ::unsetenv("ALIDADE_LOG"); }

  static Arguments Run(Arguments more) {
    more.insert(more.begin(), {"run", "config.yaml", "-o", "out", "--force"});
    return more;
  }
};

TEST_F(LogCli, OptionQuietAndEnvironmentSetTheLevel) {
  const auto has = [&](const Arguments& more, bool info, bool debug) {
    const Outcome run = Call(Run(more));
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(Contains(run.err, "info: source: streams disparity, disparity_all, "), info)
        << run.err;
    EXPECT_EQ(Contains(run.err, "debug: plugin loaded: "), debug) << run.err;
    EXPECT_EQ(Contains(run.err, "debug: ekf: "), debug) << run.err;  // contains the run time
    EXPECT_EQ(run.err.empty(), !info) << run.err;
    EXPECT_FALSE(Contains(run.err, "\033["))
        << "colour is printed only if standard error is a terminal";
  };
  has({}, false, false);
  has({"--log-level", "info"}, true, false);
  has({"--log-level=debug", "--quiet"}, true, true);
  ::setenv("ALIDADE_LOG", "debug", 1);
  has({}, true, true);
  has({"--quiet"}, false, false);
  has({"--log-level", "off"}, false, false);
  ::setenv("ALIDADE_LOG", "", 1);
  has({}, false, false);
}

TEST_F(LogCli, TheLevelMayPrecedeTheCommand) {
  const Outcome run = Call({"--log-level", "debug", "doctor"});
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, Call({"doctor", "--log-level", "debug"}).err);
  EXPECT_NE(run.err, Call({"doctor"}).err);
}

TEST_F(LogCli, AnUnknownLevelIsAUsageError) {
  const std::string what =
      "'loud' is not a log level; expected one of trace, debug, info, warning, error, off";
  const Outcome option = Call({"doctor", "--log-level", "loud"});
  EXPECT_EQ(option.code, 2);
  EXPECT_EQ(option.err, "error: --log-level: " + what + "\nsee `alidade doctor --help`\n");
  ::setenv("ALIDADE_LOG", "loud", 1);
  const Outcome variable = Call(Run({}));
  EXPECT_EQ(variable.code, 2);
  EXPECT_EQ(variable.err, "error: ALIDADE_LOG: " + what + "\nsee `alidade run --help`\n");
  EXPECT_FALSE(Exists("out"));
}

TEST_F(LogCli, EveryCommandTakesALevel) {
  for (const Arguments& command : {Arguments{"run"},
                                   {"compare"},
                                   {"sweep"},
                                   {"simulate"},
                                   {"bundle"},
                                   {"explain"},
                                   {"plugins", "list"},
                                   {"plugins", "info"},
                                   {"plugins", "where"},
                                   {"check"},
                                   {"eval"},
                                   {"doctor"}}) {
    Arguments help = command;
    help.push_back("--help");
    EXPECT_TRUE(Contains(Call(help).out, "--log-level LEVEL")) << command.front();
  }
}

// log.txt contains no messages below the level info, no clock time and no path. The file is
// therefore identical for every output folder and every log level of the terminal.
TEST_F(LogCli, TheLogOfARunHasTheSameBytes) {
  const auto into = [&](const std::string& folder, const Arguments& more) {
    Arguments all = Diverging({"run", "config.yaml", "-o", folder});
    all.insert(all.end(), more.begin(), more.end());
    Call(all);
    return Read(folder + "/log.txt");
  };
  const std::string one = into("one", {}), two = into("two", {"--log-level", "trace"});
  EXPECT_EQ(one, two);
  EXPECT_TRUE(one.starts_with("info: source: streams disparity, disparity_all, ")) << one;
  EXPECT_TRUE(Contains(one,
                       "\ninfo: ekf: type ekf; sensors stereo, scale; blocks target.depth, "
                       "target.depth_rate, template.inverse_distance\n"))
      << one;
  EXPECT_TRUE(Contains(one, "ekf: diverged at t = ")) << one;
  EXPECT_FALSE(Contains(one, "debug")) << one;
  EXPECT_TRUE(Contains(Read("one/files.txt"), "log.txt\n"));
}

// A divergence is printed as a warning when it occurs. If the divergence ends the run, only the
// error is printed.
TEST_F(LogCli, ADivergenceIsAWarningOrTheErrorThatEndsTheRun) {
  const Outcome reported = Call(Diverging(Run({})));
  EXPECT_EQ(reported.code, 0) << reported.err;
  EXPECT_TRUE(reported.err.starts_with("warning: ekf: diverged at t = ")) << reported.err;
  const Outcome failed = Call(Diverging(Run({"--set", "estimators.ekf.on_divergence=fail"})));
  EXPECT_EQ(failed.code, 79) << failed.err;
  EXPECT_TRUE(failed.err.starts_with("error: estimator 'ekf' at t = ")) << failed.err;
  EXPECT_FALSE(Contains(failed.err, "warning: ")) << failed.err;
  EXPECT_EQ(Call(Diverging(Run({"--quiet"}))).err, "");
}

// In a sweep, a divergence causes a message of the level info instead of a warning. This message
// names the seed.
TEST_F(LogCli, ASweepNamesTheRunOfAMessage) {
  const Outcome quiet = Call(Diverging({"sweep", "config.yaml", "--runs", "2", "-o", "a"}));
  EXPECT_FALSE(Contains(quiet.err, "warning: ")) << quiet.err;
  const Outcome told =
      Call(Diverging({"sweep", "config.yaml", "--runs", "2", "-o", "b", "--log-level", "info"}));
  for (const char* seed : {"1", "2"}) {
    EXPECT_TRUE(Contains(told.err, "info: seed " + std::string(seed) + ": ekf: diverged at t = "))
        << told.err;
  }
}

}  // namespace
}  // namespace alidade
