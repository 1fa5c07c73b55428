// SPDX-License-Identifier: Apache-2.0
//
// Tests `alidade sweep --resume`. tests/faults/killed_run_test.cc tests sweeps that are killed.
#include <algorithm>

#include "support/run_files.h"

namespace alidade::testing {
namespace {

class SweepResumeCli : public ProgramTest {
 protected:
  static Arguments Command(const std::string& output, const Arguments& more = {}) {
    Arguments arguments = {"sweep", "config.yaml",           "--runs", "40",
                           "--set", "source.duration_s=100", "-o",     output};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  Outcome Sweep(const std::string& output, const Arguments& more = {}) const {
    return Call(Command(output, more));
  }
  /// Starts a sweep with the output `out` and stops it after three runs.
  void StopSweep(const Arguments& more = {}) const {
    const pid_t process = Start(Command("out", more));
    ASSERT_TRUE(Eventually([&] {
      const std::string runs = Read("out.partial/finished_runs.jsonl");
      return std::ranges::count(runs, '\n') >= 3;
    }));
    ::kill(process, SIGTERM);
    const Outcome stopped = Wait(process);
    ASSERT_EQ(stopped.code, 75) << stopped.err;
    EXPECT_TRUE(Contains(stopped.err, " of ")) << stopped.err;
    EXPECT_TRUE(Contains(stopped.err, " runs; continue with: alidade sweep ")) << stopped.err;
    EXPECT_TRUE(stopped.err.ends_with(" --resume\n")) << stopped.err;
    EXPECT_FALSE(Exists("out"));
  }
};

TEST_F(SweepResumeCli, GoesOnToTheSameBytes) {
  ASSERT_EQ(Sweep("whole").code, 0);
  StopSweep();
  EXPECT_EQ(Json("out.partial/sweep.json").root().At("status").Text(), "stopped");
  const Outcome refused = Sweep("out");
  EXPECT_EQ(refused.code, 73) << refused.err;
  EXPECT_TRUE(refused.err.starts_with("error: out.partial: exists already")) << refused.err;
  const Outcome resumed = Sweep("out", {"--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(resumed.err.starts_with("resuming out.partial: ")) << resumed.err;
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
  EXPECT_FALSE(Exists("out.partial"));
  const Outcome again = Sweep("out", {"--resume"});
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.err, "out is already finished\n");
}

TEST_F(SweepResumeCli, GoesOnWithVariedValues) {
  const Arguments vary = {"--vary", "sensors.stereo.sigma_px=0.5,1"};
  ASSERT_EQ(Sweep("whole", vary).code, 0);
  StopSweep(vary);
  Arguments more = vary;
  more.emplace_back("--resume");
  EXPECT_EQ(Sweep("out", more).code, 0) << Read("stderr");
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
}

// The file ends with an incomplete line, as if the process had been killed while it wrote this
// line.
TEST_F(SweepResumeCli, TakesFinishedRunsFromTheFile) {
  StopSweep({"--jobs", "1"});
  std::string text = Read("out.partial/finished_runs.jsonl");
  const std::size_t run = text.find("\"seed\":2,");
  ASSERT_NE(run, text.npos) << text;
  const std::string key = "\"rmse:target.depth\":";
  const std::size_t value = text.find(key, run) + key.size();
  text.replace(value, text.find_first_of(",}", value) - value, "0.125");
  Write("out.partial/finished_runs.jsonl", text + text.substr(0, 40));
  EXPECT_EQ(Sweep("out", {"--resume"}).code, 0) << Read("stderr");
  const std::string runs = Read("out/runs.csv");
  EXPECT_TRUE(Contains(runs.substr(runs.find("\n2,ekf,"), 300), ",0.125,")) << runs;
}

TEST_F(SweepResumeCli, StartsIfThereIsNothingToResume) {
  EXPECT_EQ(Sweep("out", {"--resume"}).code, 0) << Read("stderr");
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs", "2", "--resume"}).code, 2)
      << "--resume requires -o";
  EXPECT_EQ(Sweep("other", {"--resume", "--force"}).code, 2);
}

TEST_F(SweepResumeCli, AFinishedOneWithFailuresHasItsExitCodeAgain) {
  Write("table.csv", "t_s,d\n0,80\n0.1,none\n");
  const Arguments sweep = {"sweep", "table.yaml", "--runs", "2", "-o", "out", "--resume"};
  ASSERT_EQ(Call(sweep).code, 1);
  const auto files = RunFiles(folder_ / "out");
  ASSERT_TRUE(files.contains("failures.csv"));
  const Outcome again = Call(sweep);
  EXPECT_EQ(again.code, 1);
  EXPECT_EQ(again.err, "out is already finished\n");
  EXPECT_EQ(RunFiles(folder_ / "out"), files);
}

TEST_F(SweepResumeCli, RefusesAnotherSweep) {
  StopSweep();
  const std::string before = Read("out.partial/finished_runs.jsonl");
  const Outcome options = Sweep("out", {"--resume", "--first-seed", "5"});
  EXPECT_EQ(options.code, 73);
  EXPECT_TRUE(options.err.starts_with(
      "error: out.partial: the folder was made from other inputs: command: now 'sweep --runs 40 "
      "--first-seed 5', was 'sweep --runs 40 --first-seed 1'; "))
      << options.err;
  const Outcome config = Sweep("out", {"--resume", "--set", "sensors.stereo.sigma_px=2"});
  EXPECT_EQ(config.code, 73);
  EXPECT_TRUE(Contains(config.err, "config.resolved.yaml:")) << config.err;
  EXPECT_EQ(Read("out.partial/finished_runs.jsonl"), before);
  EXPECT_EQ(Sweep("out", {"--resume"}).code, 0) << Read("stderr");
  const Outcome finished = Sweep("out", {"--resume", "--first-seed", "5"});
  EXPECT_EQ(finished.code, 73);
  EXPECT_TRUE(finished.err.starts_with("error: out: the folder was made from other inputs: "))
      << finished.err;
}

TEST_F(SweepResumeCli, ReplacesNothingThatIsNoSweep) {
  ASSERT_EQ(Call({"simulate", "config.yaml", "-o", "out", "--quiet"}).code, 0);
  const auto data = RunFiles(folder_ / "out");
  const Outcome refused = Sweep("out", {"--resume"});
  EXPECT_EQ(refused.code, 73);
  EXPECT_EQ(refused.err, "error: out: exists already; add --force to replace it\n");
  EXPECT_EQ(RunFiles(folder_ / "out"), data);
  fs::create_directory(folder_ / "mine.partial");
  Write("mine.partial/notes.txt", "mine");
  EXPECT_EQ(Sweep("mine", {"--resume"}).code, 73);
  EXPECT_EQ(RunFiles(folder_ / "mine.partial").size(), 1u);
}

}  // namespace
}  // namespace alidade::testing
