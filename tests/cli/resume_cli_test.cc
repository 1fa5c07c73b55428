// SPDX-License-Identifier: Apache-2.0
//
// What `--resume` does with what it finds. Runs killed at any moment are in
// tests/faults/killed_run_test.cc.
#include <algorithm>

#include "support/run_files.h"

namespace alidade::testing {
namespace {

class ResumeCli : public ProgramTest {
 protected:
  Outcome Run(Arguments more, const std::string& config = "config.yaml") const {
    Arguments arguments = {"run", config, "--no-figures", "-o", "out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Call(arguments);
  }
  /// Leaves what a run leaves that cannot write on, after some rows; the name of that folder.
  std::string Interrupt(const Arguments& more = {}, const std::string& config = "config.yaml") {
    before_ = "ulimit -f 16";
    EXPECT_EQ(Run(more, config).code, 74);
    before_.clear();
    EXPECT_EQ(Leftovers().size(), 1u);
    return Leftovers().empty() ? "" : Leftovers()[0];
  }
  std::vector<std::string> Leftovers() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("out.failed-") || name.starts_with(".out.")) names.push_back(name);
    }
    return names;
  }
  void ExpectRefused(const Outcome& outcome, const std::string& leftover,
                     const std::string& what) const {
    EXPECT_EQ(outcome.code, 73) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("error: " + (folder_ / leftover).string() +
                                        ": was made from other inputs: " + what))
        << outcome.err;
    EXPECT_TRUE(Exists(leftover + "/measurements.csv"));
    EXPECT_EQ(Leftovers(), std::vector<std::string>{leftover});
    EXPECT_FALSE(Exists("out"));
  }
  /// Sends SIGTERM to `command` as soon as `file` in its partial folder has so many lines.
  Outcome Stop(const Arguments& command, const std::string& file, int lines = 0) const {
    const pid_t process = Start(command);
    const std::string path = ".out.partial-" + std::to_string(process) + '/' + file;
    const auto begun = [&] {
      if (!Exists(path)) return false;
      const std::string text = Read(path);
      return std::ranges::count(text, '\n') >= lines;
    };
    for (int i = 0; i < 200'000 && !begun(); ++i) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    ::kill(process, SIGTERM);
    return Wait(process);
  }
  void WriteTable(double last) const {
    std::string table = "t_s,d\n";
    for (int i = 0; i < 400; ++i) table += std::to_string(0.03 * i) + ",80\n";
    Write("table.csv", table + "12.03," + std::to_string(last) + '\n');
  }

  const Arguments long_ = {"--set", "source.duration_s=300"};
};

TEST_F(ResumeCli, GoesOnAfterAFailureToTheSameBytes) {
  ASSERT_EQ(Call({"run", "config.yaml", "--no-figures", "-o", "whole"}).code, 0);
  const std::string leftover = Interrupt();
  const Outcome resumed = Run({"--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(resumed.err, "resuming " + (folder_ / leftover).string() +
                             ": its frames are computed again, and compared\n");
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
  EXPECT_EQ(Leftovers(), std::vector<std::string>{});
}

TEST_F(ResumeCli, LeavesWhatItDidNotWrite) {
  const std::string leftover = Interrupt();
  Write(leftover + "/notes.txt", "mine");
  const Outcome resumed = Run({"--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(Contains(resumed.err, leftover + " stays: it holds what out has not\n"))
      << resumed.err;
  EXPECT_EQ(RunFiles(folder_ / leftover),
            (std::map<std::string, std::string>{{"notes.txt", "mine"}}));
}

// A process that was killed while it removed what it had resumed leaves empty folders.
TEST_F(ResumeCli, EmptyFoldersAreNothingToResume) {
  fs::create_directories(folder_ / "out.failed-1/ekf");
  const Outcome fresh = Run({"--resume"});
  EXPECT_EQ(fresh.code, 0) << fresh.err;
  EXPECT_FALSE(Exists("out.failed-1"));
  fs::create_directories(folder_ / "out.failed-1/ekf");
  EXPECT_EQ(Run({"--resume"}).code, 0) << "finished";
  EXPECT_FALSE(Exists("out.failed-1"));
}

TEST_F(ResumeCli, WithNothingToResumeSaysSo) {
  const Outcome fresh = Run({"--resume"});
  EXPECT_EQ(fresh.code, 0) << fresh.err;
  EXPECT_EQ(fresh.err, "out: nothing to resume, starting anew\n");
  const std::string before = Read("out/timing.json");
  const Outcome again = Run({"--resume"});
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.err, "out is finished: nothing to resume\n");
  EXPECT_EQ(Read("out/timing.json"), before);
  const Outcome other = Run({"--resume", "--seed", "2"});
  EXPECT_EQ(other.code, 73);
  EXPECT_TRUE(Contains(other.err,
                       "error: out: was made from other inputs: "
                       "config.resolved.yaml:"))
      << other.err;
  EXPECT_TRUE(Contains(other.err, "; add --force to replace it\n")) << other.err;
  EXPECT_EQ(Read("out/timing.json"), before);
  EXPECT_EQ(Run({"--resume", "--seed", "2", "--force"}).code, 0);
  EXPECT_NE(Read("out/timing.json"), before);
  EXPECT_EQ(Call({"run", "config.yaml", "--resume"}).code, 2);  // without -o
}

TEST_F(ResumeCli, ReplacesNothingButWhatIsUnfinished) {
  ASSERT_EQ(Call({"simulate", "config.yaml", "-o", "out", "--quiet"}).code, 0);
  const auto data = RunFiles(folder_ / "out");
  ASSERT_FALSE(data.empty());
  const Outcome run = Run({"--resume"});
  EXPECT_EQ(run.code, 73);
  EXPECT_EQ(run.err, "error: out: is no unfinished run; add --force to replace it\n");
  const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "1", "-o", "out", "--resume"});
  EXPECT_EQ(sweep.code, 73);
  EXPECT_EQ(sweep.err, run.err);
  EXPECT_EQ(RunFiles(folder_ / "out"), data);
  EXPECT_EQ(Leftovers(), std::vector<std::string>{});
  EXPECT_EQ(Run({"--resume", "--force"}).code, 0) << Read("stderr");
}

TEST_F(ResumeCli, RefusesAnotherConfig) {
  const std::string leftover = Interrupt();
  ExpectRefused(Run({"--resume", "--seed", "2"}), leftover, "config.resolved.yaml:");
  ExpectRefused(Run({"--resume", "--set", "estimators.ekf.gate=0.99"}), leftover,
                "config.resolved.yaml:");
  ExpectRefused(Run({"--resume", "--covariances"}), leftover,
                "command: now 'run --no-figures --covariances', was 'run --no-figures'; ");
}

TEST_F(ResumeCli, KnowsTheSameConfigByAnotherName) {
  WriteTable(80);
  Interrupt({}, "./table.yaml");
  EXPECT_EQ(Run({"--resume"}, "table.yaml").code, 0) << Read("stderr");
}

TEST_F(ResumeCli, RefusesOtherData) {
  WriteTable(80);
  const std::string leftover = Interrupt({}, "table.yaml");
  WriteTable(81);
  ExpectRefused(Run({"--resume"}, "table.yaml"), leftover,
                "data " + (folder_ / "table.csv").string() + ": now ");
  WriteTable(80);
  EXPECT_EQ(Run({"--resume"}, "table.yaml").code, 0);
}

TEST_F(ResumeCli, RefusesAnotherPlugin) {
  fs::create_directory(folder_ / "own");
  fs::permissions(folder_ / "own", fs::perms::owner_all);
  fs::copy_file(ALIDADE_BINARY_DIR "/tests/faults/ratio.so", folder_ / "own/ratio.so");
  const Arguments more = {"--plugin-path", "own", "--set",
                          "sensors.ratio={model: ratio, stream: inverse_scale, roles: {numerator: "
                          "target.depth, denominator: template.inverse_distance}}"};
  const std::string leftover = Interrupt(more);
  std::ofstream(folder_ / "own/ratio.so", std::ios::app | std::ios::binary) << "another build";
  Arguments resume = more;
  resume.emplace_back("--resume");
  ExpectRefused(Run(resume), leftover, "plugin ratio.so: now ");
}

TEST_F(ResumeCli, RefusesASourceThatCanBeReadOnce) {
  ASSERT_EQ(::mkfifo((folder_ / "table.csv").c_str(), 0600), 0);
  const Outcome outcome = Run({"--resume"}, "table.yaml");
  EXPECT_EQ(outcome.code, 78);
  EXPECT_TRUE(Contains(outcome.err,
                       "can be read once, but a run that is resumed reads it from its "
                       "start; expected a regular file"))
      << outcome.err;
}

TEST_F(ResumeCli, NamesTheFirstRowThatDiffers) {
  const std::string leftover = Interrupt();
  const std::string file = leftover + "/ekf/innovations.csv";
  std::string rows = Read(file);
  const std::size_t third = rows.find('\n', rows.find('\n') + 1) + 1;
  rows.replace(third, 5, "9.999");
  Write(file, rows);
  const Outcome outcome = Run({"--resume"});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "error: " + (folder_ / file).string() + ":3:1: now '0.0"))
      << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "', was '9.999")) << outcome.err;
  EXPECT_EQ(Leftovers(), std::vector<std::string>{leftover});
  EXPECT_FALSE(Exists("out"));
}

// The row at which a process was killed may be cut anywhere.
TEST_F(ResumeCli, TakesARowThatWasCutForNone) {
  const std::string leftover = Interrupt();
  const std::string file = leftover + "/ekf/estimates.csv";
  Write(file, Read(file) + "0.1,7");
  EXPECT_EQ(Run({"--resume"}).code, 0) << Read("stderr");
  EXPECT_EQ(Leftovers(), std::vector<std::string>{});
}

TEST_F(ResumeCli, GoesOnAfterASignal) {
  Arguments command = {"run", "config.yaml", "--no-figures", "-o", "out"};
  command.insert(command.end(), long_.begin(), long_.end());
  Arguments whole = command;
  whole[4] = "whole";
  ASSERT_EQ(Call(whole).code, 0);
  ASSERT_EQ(Stop(command, ".keep").code, 75);
  EXPECT_EQ(Json("out/run.json").root().At("status").Text(), "stopped");
  command.emplace_back("--resume");
  const Outcome resumed = Call(command);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(Contains(resumed.err, "resuming out: ")) << resumed.err;
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
}

// The estimates of a smoother rest on later data, which a run that was stopped has not.
TEST_F(ResumeCli, GoesOnAfterASignalWithASmoother) {
  Arguments command = {"run", "config.yaml", "--no-figures", "-o", "out"};
  command.insert(command.end(), long_.begin(), long_.end());
  command.insert(command.end(), {"--set", "estimators={ekf: {type: ekf}, rts: {type: rts}}"});
  Arguments whole = command;
  whole[4] = "whole";
  ASSERT_EQ(Call(whole).code, 0) << Read("stderr");
  ASSERT_EQ(Stop(command, ".keep").code, 75);
  ASSERT_TRUE(Exists("out/rts/estimates.csv"));
  command.emplace_back("--resume");
  const Outcome resumed = Call(command);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(Contains(resumed.err, "resuming out: ")) << resumed.err;
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
}

// What a run had come to is not lost to one that resumes it and comes less far.
TEST_F(ResumeCli, AStopBeforeWhatIsThereKeepsThat) {
  before_ = "ulimit -f 1400";
  ASSERT_EQ(Run(long_).code, 74);
  before_.clear();
  const std::vector<std::string> leftover = Leftovers();
  ASSERT_EQ(leftover.size(), 1u);
  const auto rows = RunFiles(folder_ / leftover[0]);
  Arguments command = {"run", "config.yaml", "--no-figures", "-o", "out", "--resume"};
  command.insert(command.end(), long_.begin(), long_.end());
  const Outcome stopped = Stop(command, "inputs.json");
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_TRUE(Contains(stopped.err, ": has more rows than this run, which came to "))
      << stopped.err;
  EXPECT_EQ(Leftovers(), leftover);
  EXPECT_EQ(RunFiles(folder_ / leftover[0]), rows);
  EXPECT_FALSE(Exists("out"));
  EXPECT_EQ(Call(command).code, 0) << Read("stderr");
}

// ---- sweeps

class ResumeSweepCli : public ResumeCli {
 protected:
  Outcome Sweep(const std::string& output, const Arguments& more = {}) const {
    Arguments arguments = {"sweep", "config.yaml",          "--runs", "40",
                           "--set", "source.duration_s=20", "-o",     output};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Call(arguments);
  }
  /// Stops a sweep into `out` after some runs.
  void StopSweep(const Arguments& more = {}) {
    Arguments arguments = {"sweep", "config.yaml",          "--runs", "40",
                           "--set", "source.duration_s=20", "-o",     "out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ASSERT_EQ(Stop(arguments, "finished_runs.jsonl", 3).code, 75) << Read("stderr");
    ASSERT_TRUE(Exists("out/finished_runs.jsonl"));
  }
  /// Changes the first number of runs of seed `seed` that are kept.
  void Tamper(int seed) const {
    std::string text = Read("out/finished_runs.jsonl");
    const std::size_t run = text.find("\"seed\":" + std::to_string(seed) + ",");
    ASSERT_NE(run, text.npos) << text;
    const std::string key = "\"rmse:target.depth\":";
    const std::size_t value = text.find(key, run) + key.size();
    text.replace(value, text.find_first_of(",}", value) - value, "0.125");
    Write("out/finished_runs.jsonl", text);
  }
};

TEST_F(ResumeSweepCli, GoesOnToTheSameBytes) {
  ASSERT_EQ(Sweep("whole").code, 0);
  StopSweep();
  const Outcome resumed = Sweep("out", {"--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(Contains(resumed.err, "resuming out: ")) << resumed.err;
  EXPECT_FALSE(Contains(resumed.err, ": 0 runs are finished")) << resumed.err;
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
  EXPECT_EQ(Sweep("out", {"--resume"}).err, "out is finished: nothing to resume\n");
}

// A signal before the first new run leaves the summary of those that were finished.
TEST_F(ResumeSweepCli, AStopKeepsWhatWasFinished) {
  StopSweep({"--jobs", "1"});
  const double before = Json("out/sweep.json").root().At("runs_used").Number();
  ASSERT_GT(before, 0);
  const Outcome stopped = Stop({"sweep", "config.yaml", "--runs", "40", "--set",
                                "source.duration_s=20", "-o", "out", "--jobs", "1", "--resume"},
                               "inputs.json");
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_GE(Json("out/sweep.json").root().At("runs_used").Number(), before);
  EXPECT_EQ(Sweep("out", {"--resume"}).code, 0) << Read("stderr");
}

TEST_F(ResumeSweepCli, AFinishedOneWithFailuresHasItsExitCodeAgain) {
  Write("table.csv", "t_s,d\n0,80\n0.1,none\n");
  const Arguments sweep = {"sweep", "table.yaml", "--runs", "2", "-o", "out"};
  ASSERT_EQ(Call(sweep).code, 1);
  const auto files = RunFiles(folder_ / "out");
  ASSERT_TRUE(files.contains("failures.csv"));
  Arguments resume = sweep;
  resume.emplace_back("--resume");
  const Outcome again = Call(resume);
  EXPECT_EQ(again.code, 1);
  EXPECT_EQ(again.err, "out is finished: nothing to resume\n");
  EXPECT_EQ(RunFiles(folder_ / "out"), files);
}

TEST_F(ResumeSweepCli, TakesFinishedRunsFromTheDisk) {
  StopSweep({"--jobs", "1"});
  Tamper(2);
  EXPECT_EQ(Sweep("out", {"--resume"}).code, 0) << Read("stderr");
  const std::string runs = Read("out/runs.csv");
  EXPECT_TRUE(Contains(runs.substr(runs.find("\n2,ekf,"), 300), ",0.125,")) << runs;
}

TEST_F(ResumeSweepCli, TriesOneFinishedRunAgain) {
  StopSweep({"--jobs", "1"});
  Tamper(1);
  const Outcome outcome = Sweep("out", {"--resume"});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err,
                       "out/finished_runs.jsonl:1: the run of seed 1 gives other "
                       "results now"))
      << outcome.err;
  EXPECT_TRUE(Exists("out/finished_runs.jsonl"));
  EXPECT_EQ(Leftovers(), std::vector<std::string>{});
}

TEST_F(ResumeSweepCli, GoesOnWithVariedValues) {
  const Arguments vary = {"--vary", "sensors.stereo.sigma_px=0.5,1"};
  ASSERT_EQ(Sweep("whole", vary).code, 0);
  StopSweep(vary);
  Arguments more = vary;
  more.emplace_back("--resume");
  EXPECT_EQ(Sweep("out", more).code, 0) << Read("stderr");
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
}

TEST_F(ResumeSweepCli, RefusesAnotherSweep) {
  StopSweep();
  const Outcome outcome = Sweep("out", {"--resume", "--first-seed", "5"});
  EXPECT_EQ(outcome.code, 73);
  EXPECT_TRUE(Contains(outcome.err,
                       "command: now 'sweep --runs 40 --first-seed 5', was 'sweep "
                       "--runs 40 --first-seed 1'"))
      << outcome.err;
  EXPECT_TRUE(Exists("out/finished_runs.jsonl"));
}

}  // namespace
}  // namespace alidade::testing
