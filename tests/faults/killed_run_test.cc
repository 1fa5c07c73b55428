// SPDX-License-Identifier: Apache-2.0
//
// Tests fault 91 of tests/faults/README.md: the files of a killed run are usable, and a killed
// sweep can be resumed.
#include <algorithm>

#include "support/run_files.h"

namespace alidade::testing {
namespace {

using KilledRun = ProgramTest;

TEST_F(KilledRun, LeavesItsRowsAndARecordThatSaysRunning) {
  ASSERT_EQ(::mkfifo((folder_ / "table.csv").c_str(), 0600), 0);
  const int pipe = ::open((folder_ / "table.csv").c_str(), O_RDWR | O_CLOEXEC);
  const auto feed = [&](const std::string& rows) {
    ASSERT_EQ(::write(pipe, rows.data(), rows.size()), std::ssize(rows));
  };
  feed("t_s,d\n0,80\n");
  const pid_t run = Start({"run", "table.yaml", "-o", "out"});
  // The run writes its rows to the file once a second, at the arrival of the next row.
  int row = 0;
  ASSERT_TRUE(Eventually([&] {
    feed(std::to_string(++row) + ",80\n");
    return Contains(Read("out.partial/ekf/estimates.csv"), "\n3.000000000,");
  }));
  ::kill(run, SIGKILL);
  EXPECT_EQ(Wait(run).signal, SIGKILL);
  ::close(pipe);
  EXPECT_FALSE(Exists("out"));
  EXPECT_EQ(Json("out.partial/run.json").root().At("status").Text(), "running");
  const std::string rows = Read("out.partial/ekf/estimates.csv");

  const Outcome refused = Call({"run", "config.yaml", "-o", "out"});
  EXPECT_EQ(refused.code, 73);
  EXPECT_EQ(refused.err,
            "error: out.partial: exists already: another command ended before it completed this "
            "folder, or is still running; "
            "add --force to replace this folder, or remove it\n");
  EXPECT_EQ(Read("out.partial/ekf/estimates.csv"), rows);
  EXPECT_EQ(Call({"run", "config.yaml", "-o", "out", "--force"}).code, 0);
  EXPECT_FALSE(Exists("out.partial"));
}

TEST_F(KilledRun, OfASweepGoesOnToTheSameBytes) {
  const auto sweep = [](const std::string& output, const Arguments& more = {}) {
    Arguments all = {"sweep",  "config.yaml", "--runs", "30",  "--set", "source.duration_s=100",
                     "--jobs", "2",           "-o",     output};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  ASSERT_EQ(Call(sweep("whole")).code, 0) << Read("stderr");
  for (const int lines : {1, 6, 12}) {
    const pid_t process = Start(sweep("out", {"--resume"}));
    ASSERT_TRUE(Eventually([&] {
      const std::string runs = Read("out.partial/finished_runs.jsonl");
      return std::ranges::count(runs, '\n') >= lines;
    }));
    ::kill(process, SIGKILL);
    Wait(process);
  }
  ASSERT_TRUE(Exists("out.partial"));
  EXPECT_EQ(Json("out.partial/sweep.json").root().At("status").Text(), "running");
  const Outcome end = Call(sweep("out", {"--resume"}));
  ASSERT_EQ(end.code, 0) << end.err;
  EXPECT_TRUE(end.err.starts_with("resuming out.partial: ")) << end.err;
  ExpectSameFiles(folder_ / "out", folder_ / "whole");
  EXPECT_FALSE(Exists("out.partial"));
}

}  // namespace
}  // namespace alidade::testing
