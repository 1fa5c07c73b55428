// SPDX-License-Identifier: Apache-2.0
//
// Tests faults in the environment of a run: disk, signals and memory. The comment above each test
// contains the number of the fault. Other tests cover these faults:
//   87  Recorder.AFullDiskKeepsTheRows, OutputFile.*
//   90  PipedRun.*, Cli.Stops*, Cli.Signals*, SweepCli.StopsAtASignal*
//   93  OutputFolder.AFolderThatCannotBeWrittenToIsRefused
//   97  SweepCli.GivesTheSameBytesForAnyNumberOfJobs
//   98  CommaLocale.*, Node.NumberIsReadTheSameInACommaLocale
#include <algorithm>
#include <ctime>

#include "alidade/replay/replay.h"
#include "support/program.h"
#include "support/sanitized.h"

namespace alidade::testing {
namespace {

class RunSafety : public ProgramTest {
 protected:
  /// Expects that the folder has no files other than those of the fixture and `names`.
  void ExpectOnly(std::vector<std::string> names) const {
    names.insert(names.end(), {"config.yaml", "table.yaml", "stdout", "stderr"});
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename();
      EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
    }
  }
  /// Expects that the folder `out` does not exist, that its record contains the reason of the
  /// failure, or that the run was complete and the page could not be written.
  void ExpectRecordOfFailure(const std::string& reason) const {
    ExpectOnly({"out"});
    if (!Exists("out")) return;
    const Config record = Json("out/run.json");
    EXPECT_FALSE(Exists("out/report.html"));
    if (record.root().At("status").Text() == "ok") return;
    EXPECT_EQ(record.root().At("status").Text(), "failed");
    EXPECT_TRUE(Contains(record.root().At("reason").Text(), reason)) << Read("out/run.json");
  }
  /// Removes the `out.partial` of an unfinished run. Returns true if it existed.
  bool LeftPartial() const { return fs::remove_all(folder_ / "out.partial") > 0; }
  /// Returns true if the memory suffices to start the program. With less memory the C++ runtime
  /// cannot even throw, and aborts.
  bool Starts() const { return Call({"--version"}).code == 0; }
  std::string Estimates(const std::string& run) const { return Read(run + "/ekf/estimates.csv"); }
};

// Tests fault 88 of tests/faults/README.md.
TEST_F(RunSafety, EveryLimitOnTheSizeOfFilesIsAnErrorWithThePath) {
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "whole"}).code, 0);
  const std::uintmax_t page = fs::file_size(folder_ / "whole/report.html");
  std::uintmax_t largest = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "whole")) {
    const bool is_data = entry.is_regular_file() && entry.path().filename() != "report.html";
    if (is_data) largest = std::max(largest, entry.file_size());
  }
  ASSERT_LT(largest, page);
  fs::remove_all(folder_ / "whole");
  int refused = 0, kept = 0, without_page = 0;
  for (std::uintmax_t blocks = 0; blocks <= page / 512 + 1; blocks += 1 + blocks / 3) {
    // `ulimit -f` counts blocks of 512 bytes.
    before_ = "ulimit -f " + std::to_string(blocks) + "; exec 2>/dev/null >/dev/null";
    const Outcome run = Call({"run", "config.yaml", "-o", "out"});
    EXPECT_EQ(run.signal, 0) << blocks;
    const bool data_fit = blocks * 512 >= largest, page_fits = blocks * 512 >= page;
    EXPECT_EQ(run.code, page_fits ? 0 : 74) << blocks;
    kept += LeftPartial() ? 1 : 0;
    ExpectOnly({"out"});
    EXPECT_EQ(Exists("out"), data_fit) << blocks;
    EXPECT_EQ(Exists("out/report.html"), page_fits) << blocks;
    refused += run.code == 74 ? 1 : 0;
    without_page += data_fit && !page_fits ? 1 : 0;
    fs::remove_all(folder_ / "out");
  }
  EXPECT_GT(refused, 5);
  EXPECT_GT(kept, 5);
  EXPECT_GT(without_page, 1);
  before_ = "ulimit -f 12";
  const Outcome run = Call({"run", "config.yaml", "-o", "out", "--force"});
  EXPECT_TRUE(run.err.starts_with("error: out.partial/")) << run.err;
  EXPECT_TRUE(Contains(run.err, ": cannot write: File too large\n")) << run.err;
  const Config record = Json("out.partial/run.json");
  EXPECT_EQ(record.root().At("status").Text(), "failed");
  EXPECT_TRUE(Contains(record.root().At("reason").Text(), "cannot write: File too large"));
  EXPECT_TRUE(Contains(Read("out.partial/ekf/estimates.csv"), "\n0.000000000,"));
  EXPECT_TRUE(LeftPartial());
}

// Tests fault 89 of tests/faults/README.md.
TEST_F(RunSafety, AReaderThatIsGoneIsNeitherAnErrorNorASignal) {
  for (const Arguments& command : {Arguments{"run", "config.yaml", "-o", "out"},
                                   {"sweep", "config.yaml", "--runs", "1", "-o", "sweep"},
                                   {"explain", "config.yaml"},
                                   {"plugins", "list"},
                                   {"doctor"},
                                   {"--help"}}) {
    // The shell closes the reading end of this pipe before the program starts.
    ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
    before_ = "exec 3<>pipe 1>pipe 3<&-";
    const Outcome outcome = Call(command);
    EXPECT_EQ(outcome.signal, 0) << command[0];
    EXPECT_EQ(outcome.code, 0) << command[0];
    EXPECT_EQ(outcome.err, "") << command[0];
    fs::remove(folder_ / "pipe");
  }
  // The run and the sweep were completed before the output was lost.
  EXPECT_EQ(Json("out/run.json").root().At("status").Text(), "ok");
  EXPECT_EQ(Json("sweep/sweep.json").root().At("runs_used").Number(), 1);
}

// Tests fault 92 of tests/faults/README.md.
TEST_F(RunSafety, WhatIsThereIsReplacedByForceOnly) {
  const Arguments run = {"run", "config.yaml", "-o", "out"};
  ASSERT_EQ(Call(run).code, 0);
  const std::string before = Estimates("out");
  Arguments other = run;
  other.insert(other.end(), {"--seed", "2"});
  const Outcome refused = Call(other);
  EXPECT_EQ(refused.code, 73);
  EXPECT_EQ(refused.err, "error: out: exists already; add --force to replace it\n");
  EXPECT_EQ(Estimates("out"), before);
  other.push_back("--force");
  EXPECT_EQ(Call(other).code, 0);
  EXPECT_NE(Estimates("out"), before);
}

// Tests fault 92 of tests/faults/README.md: --force does not delete runs inside the folder of a
// run.
TEST_F(RunSafety, ForceSparesRunsInsideARun) {
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "out"}).code, 0);
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "out/base"}).code, 0);
  ASSERT_EQ(Call({"sweep", "config.yaml", "--runs", "1", "-o", "out/ekf/sweep"}).code, 0);
  for (const Arguments& command :
       {Arguments{"run", "config.yaml"}, {"sweep", "config.yaml", "--runs", "1"}}) {
    Arguments all = command;
    all.insert(all.end(), {"-o", "out", "--force"});
    const Outcome refused = Call(all);
    EXPECT_EQ(refused.code, 73);
    EXPECT_EQ(
        refused.err,
        "error: out: contains files that alidade did not write: 'base', 'ekf/sweep'; move them, "
        "or choose another folder\n");
  }
  EXPECT_TRUE(Exists("out/base/run.json"));
  EXPECT_TRUE(Exists("out/ekf/sweep/sweep.json"));
}

// Tests fault 94 of tests/faults/README.md.
TEST_F(RunSafety, TheClockIsInTimingAlone) {
  const auto record = [&](const std::string& output) {
    const Outcome run = Call({"run", "config.yaml", "-o", output, "--quiet"});
    EXPECT_EQ(run.code, 0) << run.err;
  };
  record("one");
  const std::time_t second = std::time(nullptr);
  ASSERT_TRUE(Eventually([&] { return std::time(nullptr) > second; }));
  record("two");
  int same = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "one")) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().lexically_relative(folder_ / "one");
    if (internal::HasWallClock(name)) {
      EXPECT_NE(Read("one/" + name), Read("two/" + name)) << name;
      continue;
    }
    EXPECT_EQ(Read("one/" + name), Read("two/" + name)) << name;
    ++same;
  }
  EXPECT_GT(same, 12);
}

// Tests fault 96 of tests/faults/README.md.
TEST_F(RunSafety, MemoryThatRunsOutIsAnErrorAndARecord) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer maps more memory than the limits of this test";
  int failed = 0, recorded = 0;
  for (int kib = 8'000; kib <= 60'000; kib += kib < 20'000 ? 3'000 : 1'000) {
    fs::remove_all(folder_ / "out");
    before_ = "ulimit -c 0; ulimit -v " + std::to_string(kib);
    if (!Starts()) continue;
    const Outcome run =
        Call({"run", "config.yaml", "-o", "out", "--set", "source.duration_s=2000"});
    EXPECT_EQ(run.signal, 0) << kib << " KiB: " << run.err;
    if (run.code == 0) break;
    if (run.code == 127) continue;  // the dynamic loader ran out of memory
    if (run.code == 69) {
      // The program ran out of memory when it loaded a plugin or read the folder of the plugins.
      EXPECT_TRUE(Contains(run.err, "cannot be loaded") ||
                  Contains(run.err, "plugins: Cannot allocate memory"))
          << kib << " KiB: " << run.err;
      continue;
    }
    EXPECT_EQ(run.code, 70) << kib << " KiB: " << run.err;
    EXPECT_TRUE(Contains(run.err, "error: out of memory")) << kib << " KiB: " << run.err;
    LeftPartial();
    ExpectRecordOfFailure("out of memory");
    ++failed;
    recorded += Exists("out") ? 1 : 0;
  }
  EXPECT_GT(failed, 0);
  EXPECT_GT(recorded, 0);
}

// Tests fault 96 of tests/faults/README.md: the threads of a sweep run out of memory.
TEST_F(RunSafety, MemoryThatRunsOutEndsRunsOfASweepNotTheProgram) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer maps more memory than the limits of this test";
  int failed = 0;
  for (int kib = 8'000; kib <= 60'000; kib += 250) {
    fs::remove_all(folder_ / "out");
    fs::remove_all(folder_ / "out.partial");  // of a sweep without memory for a plugin
    before_ = "ulimit -c 0; ulimit -v " + std::to_string(kib);
    if (!Starts()) continue;
    const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "6", "--jobs", "3", "-o", "out",
                                "--set", "source.duration_s=500"});
    EXPECT_EQ(sweep.signal, 0) << kib << " KiB: " << sweep.err;
    if (sweep.code == 0) break;
    // The memory does not suffice to load the program or a plugin.
    if (sweep.code == 69 || sweep.code == 127) continue;
    EXPECT_TRUE(sweep.code == 1 || sweep.code == 70) << kib << " KiB: " << sweep.err;
    EXPECT_TRUE(Contains(sweep.err, "out of memory")) << kib << " KiB: " << sweep.err;
    // With code 70 the sweep ended early, or only its page is missing.
    EXPECT_TRUE(sweep.code == 70 || Exists("out/failures.csv")) << kib << " KiB";
    EXPECT_FALSE(sweep.code == 70 && Exists("out/report.html")) << kib << " KiB";
    ++failed;
  }
  EXPECT_GT(failed, 0);
}

}  // namespace
}  // namespace alidade::testing
