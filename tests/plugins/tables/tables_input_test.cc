// SPDX-License-Identifier: Apache-2.0
//
// Tests tables from files, from pipes and from standard input.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <thread>

#include "support/peak_memory.h"
#include "tables_fixture.h"

namespace alidade::testing {
namespace {

TEST_F(Tables, DashIsStandardInput) {
  for (const char* written : {"\"-\"", "-"}) {
    Write("t_s,z\n0,1\n1,x\n");
    const int kept = dup(STDIN_FILENO), file = open(File().c_str(), O_RDONLY);
    dup2(file, STDIN_FILENO);
    close(file);
    config_ = std::make_unique<Config>(Config::FromText("path: q\nstreams: {z: z}\n", "run.yaml"));
    config_->Set("path", written, "--set");
    const auto source = OpenConfig();
    SourceFrame frame;
    EXPECT_TRUE(source->Next(frame));
    ExpectError(ExitCode::kBadData,
                "<stdin>:3:3 z: 'x' is not a number; expected a finite number, or "
                "'missing: [x]'",
                [&] { source->Next(frame); });
    dup2(kept, STDIN_FILENO);
    close(kept);
  }
}

TEST_F(Tables, ReadsAPipeAsItIsWritten) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  int descriptor = -1;
  std::thread writer([&] {
    descriptor = open(File().c_str(), O_WRONLY);
    EXPECT_EQ(write(descriptor, "t_s,z\n0,1\n1", 11), 11);
  });
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  SourceFrame frame;
  EXPECT_TRUE(source->Next(frame));  // Next() returns although the pipe is still open
  writer.join();
  EXPECT_EQ(write(descriptor, ",2\n", 3), 3);
  EXPECT_TRUE(source->Next(frame));
  EXPECT_EQ(frame.measurements[0].values[0], 2.0);
  close(descriptor);
  EXPECT_FALSE(source->Next(frame));
}

TEST_F(Tables, ASignalEndsTheWaitForAPipe) {
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  const int both_ends = open(File().c_str(), O_RDWR);  // no end of file while a writer is open
  ASSERT_EQ(write(both_ends, "t_s,z\n", 6), 6);
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  struct sigaction action {
  }, before{};
  action.sa_handler = [](int) {};
  sigaction(SIGALRM, &action, &before);
  const itimerval every_50_ms{{0, 50000}, {0, 50000}}, never{};
  setitimer(ITIMER_REAL, &every_50_ms, nullptr);
  SourceFrame frame;
  ExpectError(ExitCode::kStopped, "FILE:1: stopped by a signal while waiting for data",
              [&] { source->Next(frame); });
  setitimer(ITIMER_REAL, &never, nullptr);
  sigaction(SIGALRM, &before, nullptr);
  close(both_ends);
}

TEST_F(Tables, RefusesWhatCannotBeRead) {
  const auto expect = [&](const std::string& reason) {
    ExpectError(ExitCode::kInputMissing,
                "run.yaml:1:7 path: cannot read 'FILE': " + reason + "; expected a readable file",
                [&] { Open(); });
  };
  expect("No such file or directory");
  fs::create_directory(File());
  expect("Is a directory");
  fs::remove(File());
  if (geteuid() == 0) return;  // permissions do not restrict root
  Write("t_s\n");
  fs::permissions(File(), fs::perms::none);
  expect("Permission denied");
}

TEST_F(Tables, NoticesAFileThatChangesWhileItIsRead) {
  Write("t_s,z\n0,1\n");
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  SourceFrame frame;
  EXPECT_TRUE(source->Next(frame));
  std::ofstream(File(), std::ios::app) << "1,2\n";
  ExpectError(ExitCode::kIo, "FILE:3: the file changed while it was read", [&] {
    while (source->Next(frame)) {
    }
  });
}

TEST_F(Tables, StreamsALongFileInConstantMemory) {
  // A thread writes 2e6 rows, about 40 MB, to a pipe. The peak memory may grow by 4 MB.
  ASSERT_EQ(mkfifo(File().c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream out(File());
    out << "t_s,z\n";
    for (int i = 0; i < 2000000; ++i) out << i << ",1.234567890\n";
  });
  const auto source = Open("path: a.csv\nstreams: {z: z}\n");
  SourceFrame frame;
  const long before = PeakMemory();
  int count = 0;
  while (source->Next(frame)) ++count;
  writer.join();
  EXPECT_EQ(count, 2000000);
  EXPECT_LT(PeakMemory() - before, 4096);
}

}  // namespace
}  // namespace alidade::testing
