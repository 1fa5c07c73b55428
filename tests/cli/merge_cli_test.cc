// SPDX-License-Identifier: Apache-2.0
//
// Tests `alidade merge`: the merged shards of a sweep give the same bytes as a sweep in one
// process.
#include "support/run_files.h"

namespace alidade::testing {
namespace {

class MergeCli : public ProgramTest {
 protected:
  /// Runs a sweep of 7 seeds. An empty `shard` selects all seeds.
  Outcome Sweep(const std::string& output, const std::string& shard,
                const Arguments& more = {}) const {
    Arguments arguments = {"sweep", config_, "--runs", runs_, "--first-seed", "5", "-o", output};
    if (!shard.empty()) arguments.insert(arguments.end(), {"--shard", shard});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Call(arguments);
  }
  /// Runs the shards s1, s2 and s3, each with a different number of jobs, and then the whole sweep.
  void SweepAll(const Arguments& more = {}, int code = 0) const {
    EXPECT_EQ(Sweep("whole", "", more).code, code) << Read("stderr");
    for (const std::string i : {"1", "2", "3"}) {
      Arguments with = more;
      with.insert(with.end(), {"--jobs", i});
      const Outcome shard = Sweep("s" + i, i + "/3", with);
      EXPECT_TRUE(shard.code == 0 || shard.code == code) << shard.err;
    }
  }
  Outcome Merge(const Arguments& folders, const std::string& output = "merged") const {
    Arguments arguments = {"merge"};
    arguments.insert(arguments.end(), folders.begin(), folders.end());
    arguments.insert(arguments.end(), {"-o", output});
    return Call(arguments);
  }
  void ExpectRefused(const Arguments& folders, const std::string& what, int code = 65) const {
    const Outcome outcome = Merge(folders);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, what)) << outcome.err;
    EXPECT_FALSE(Exists("merged"));
  }

  std::string config_ = "config.yaml", runs_ = "7";
};

TEST_F(MergeCli, ShardsGiveTheBytesOfOneProcess) {
  SweepAll();
  const Outcome merged = Merge({"s3", "s1", "s2"});
  EXPECT_EQ(merged.code, 0) << merged.err;
  EXPECT_TRUE(Contains(merged.out, "\nreport   merged/report.html\n")) << merged.out;
  ExpectSameFiles(folder_ / "merged", folder_ / "whole");
  EXPECT_EQ(Call({"replay", "merged"}).code, 0) << Read("stdout") << Read("stderr");
  EXPECT_EQ(Call({"replay", "s2"}).code, 0) << Read("stdout") << Read("stderr");
}

TEST_F(MergeCli, OneShardIsAWholeToo) {
  ASSERT_EQ(Sweep("whole", "").code, 0);
  ASSERT_EQ(Sweep("s1", "1/1").code, 0);
  EXPECT_EQ(Merge({"s1"}).code, 0) << Read("stderr");
  ExpectSameFiles(folder_ / "merged", folder_ / "whole");
}

TEST_F(MergeCli, ShardsOfAVariedSweepGiveItsBytesAndFigure) {
  SweepAll({"--vary", "sensors.stereo.sigma_px=0.5,2"});
  EXPECT_EQ(Merge({"s1", "s2", "s3"}).code, 0) << Read("stderr");
  ExpectSameFiles(folder_ / "merged", folder_ / "whole");
}

// One estimator starts from a diverged state. The runs of this estimator have no metrics but are
// counted.
TEST_F(MergeCli, KeepsRunsThatDiverged) {
  SweepAll(Diverging({}));
  EXPECT_EQ(Merge({"s1", "s2", "s3"}).code, 0) << Read("stderr");
  ExpectSameFiles(folder_ / "merged", folder_ / "whole");
}

TEST_F(MergeCli, KeepsRunsThatFailed) {
  Write("table.csv", "t_s,d\n0,80\n0.1,none\n");
  config_ = "table.yaml";
  runs_ = "3";
  SweepAll({}, 1);
  const Outcome merged = Merge({"s1", "s2", "s3"});
  EXPECT_EQ(merged.code, 1);
  EXPECT_TRUE(Contains(merged.err, "error: seed 6: ")) << merged.err;
  EXPECT_TRUE(Exists("merged/failures.csv"));
  ExpectSameFiles(folder_ / "merged", folder_ / "whole");
}

TEST_F(MergeCli, RefusesShardsThatAreMissingOrComeTwice) {
  SweepAll();
  ExpectRefused({"s1", "s3"}, "error: shards are missing: 2/3");
  ExpectRefused({"s2"}, "error: shards are missing: 1/3, 3/3");
  ExpectRefused({"s1", "s2", "s3", "./s2"}, "error: ./s2: shard 2/3 is given twice");
  ExpectRefused({"s1", "s2", "s4"}, "s4/inputs.json: the file cannot be read", 66);
  EXPECT_EQ(Merge({}).code, 2);
  EXPECT_EQ(Call({"merge", "s1"}).code, 2) << "--output is required";
}

TEST_F(MergeCli, RefusesShardsOfAnotherSweep) {
  ASSERT_EQ(Sweep("s1", "1/2").code, 0);
  ASSERT_EQ(Sweep("of_three", "2/3").code, 0);
  ExpectRefused({"s1", "of_three"}, "of_three: this is shard 2/3, but s1 is shard 1/2");
  ASSERT_EQ(Sweep("config", "2/2", {"--set", "sensors.stereo.sigma_px=2"}).code, 0);
  ExpectRefused(
      {"s1", "config"},
      "config: the shard belongs to another sweep than s1: config.resolved.yaml:34: now 'sigma_px: "
      "2', was 'sigma_px: 1.0'");
  ASSERT_EQ(Sweep("varied", "2/2", {"--vary", "sensors.stereo.sigma_px=2"}).code, 0);
  ExpectRefused({"s1", "varied"}, "command: now 'sweep --runs 7 --first-seed 5 --vary ");
  runs_ = "8";
  ASSERT_EQ(Sweep("seeds", "2/2").code, 0);
  ExpectRefused({"s1", "seeds"},
                "command: now 'sweep --runs 8 --first-seed 5', was 'sweep --runs 7 --first-seed "
                "5'");
  // A shard from another build is refused: inputs.json contains the build id.
  runs_ = "7";
  ASSERT_EQ(Sweep("s2", "2/2").code, 0);
  std::string inputs = Read("s2/inputs.json");
  const std::size_t id = inputs.find("\"program\": \"");
  ASSERT_NE(id, inputs.npos) << inputs;
  inputs[id + 12] = inputs[id + 12] == '0' ? '1' : '0';
  Write("s2/inputs.json", inputs);
  ExpectRefused({"s1", "s2"},
                "s2: the shard belongs to another sweep than s1: build of program: now ");
}

TEST_F(MergeCli, RefusesShardsOfOtherKernels) {
  ASSERT_EQ(Sweep("s1", "1/2").code, 0);
  if (Contains(Read("s1/inputs.json"), "\"kernels\": \"baseline\"")) {
    GTEST_SKIP() << "this processor supports only the baseline kernels";
  }
  before_ = "export ALIDADE_KERNELS=baseline";
  ASSERT_EQ(Sweep("s2", "2/2").code, 0);
  ExpectRefused({"s1", "s2"},
                "s2: the shard belongs to another sweep than s1: kernels: now 'baseline', was ");
  before_ = "export ALIDADE_KERNELS=none";
  const Outcome none = Sweep("s3", "2/2");
  EXPECT_EQ(none.code, 2);
  EXPECT_TRUE(Contains(none.err,
                       "environment variable ALIDADE_KERNELS: the instruction set 'none' is not "
                       "available"))
      << none.err;
  EXPECT_FALSE(Exists("s3"));
}

TEST_F(MergeCli, RefusesWhatIsNoFinishedShard) {
  ASSERT_EQ(Sweep("s1", "1/2").code, 0);
  ASSERT_EQ(Sweep("whole", "").code, 0);
  ExpectRefused({"s1", "whole"}, "whole/inputs.json: this is not the inputs.json of a shard");
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "run"}).code, 0);
  ExpectRefused({"run", "s1"}, "run/inputs.json: this is not the inputs.json of a shard");
  ASSERT_EQ(Sweep("s2", "2/2").code, 0);
  const std::string runs = Read("s2/finished_runs.jsonl"), summary = Read("s2/sweep.json");
  // The test damages finished_runs.jsonl of a shard in three ways: a truncated last line, a missing
  // line, and a surplus line.
  Write("s2/finished_runs.jsonl", runs.substr(0, runs.size() - 9));
  ExpectRefused({"s1", "s2"}, "s2/finished_runs.jsonl:4: the line is not the run of seed 11");
  Write("s2/finished_runs.jsonl", runs.substr(runs.find('\n') + 1));
  ExpectRefused({"s1", "s2"}, "s2/finished_runs.jsonl:1: the line is not the run of seed 8");
  Write("s2/finished_runs.jsonl", runs + runs);
  ExpectRefused({"s1", "s2"},
                "s2/finished_runs.jsonl:4: the file contains a line after the last run");
  fs::remove(folder_ / "s2/finished_runs.jsonl");
  ExpectRefused({"s1", "s2"}, "s2/finished_runs.jsonl: the file cannot be read", 66);
  std::string stopped = summary;
  stopped.replace(stopped.find("\"ok\""), 4, "\"stopped\"");
  Write("s2/sweep.json", stopped);
  ExpectRefused({"s1", "s2"}, "s2: the run or sweep was stopped before it finished");
}

TEST_F(MergeCli, ReplacesItsFolderOnlyByForceAndNeverAShard) {
  ASSERT_EQ(Sweep("s1", "1/1").code, 0);
  EXPECT_EQ(Merge({"s1"}).code, 0);
  EXPECT_EQ(Merge({"s1"}).code, 73);
  EXPECT_EQ(Call({"merge", "s1", "-o", "merged", "--force", "--quiet"}).out, "");
  EXPECT_EQ(Call({"merge", "s1", "-o", "s1", "--force"}).code, 73);
}

// A shard that was stopped and resumed gives the same files as an uninterrupted shard.
TEST_F(MergeCli, AShardThatWasResumedMergesAsAnyOther) {
  runs_ = "40";
  const Arguments longer = {"--set", "source.duration_s=100"};
  SweepAll(longer);
  Arguments again = {"sweep",   config_, "--runs", runs_,   "--first-seed",
                     "5",       "-o",    "s4",     "--set", "source.duration_s=100",
                     "--shard", "2/3",   "--jobs", "1",     "--resume"};
  const pid_t process = Start(again);
  const std::string path = "s4.partial/finished_runs.jsonl";
  ASSERT_TRUE(Eventually([&] { return Contains(Read(path), "\n"); }));
  ::kill(process, SIGTERM);
  ASSERT_EQ(Wait(process).code, 75) << Read("stderr");
  ExpectRefused({"s1", "s3", "s4.partial"},
                "s4.partial: the run or sweep was stopped before it finished");
  ExpectRefused({"s1", "s3", "s4"},
                "error: s4: the sweep is not finished: its files are in s4.partial");
  ASSERT_EQ(Call(again).code, 0) << Read("stderr");
  EXPECT_EQ(Merge({"s1", "s3", "s4"}).code, 0) << Read("stderr");
  ExpectSameFiles(folder_ / "merged", folder_ / "whole");
}

}  // namespace
}  // namespace alidade::testing
