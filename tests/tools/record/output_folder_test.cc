// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/output_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <fstream>
#include <iterator>
#include <thread>

#include "alidade/resume/leftovers.h"
#include "alidade/resume/replay.h"
#include "alidade/resume/run_inputs.h"
#include "alidade/sweep/sweep.h"
#include "support/recording.h"

namespace {

/// The n-th call of write, fsync or rename by this process fails with `error`; 0: none does.
int fail_at = 0;
int fail_error = 0;
/// The most that one write takes; 0: all.
std::size_t write_limit = 0;
/// As on a file system without locks.
bool no_locks = false;
/// The n-th rename by this process kills it instead; 0: none does.
int die_at_rename = 0;
/// What making a file or folder fails with; 0: it does not.
int create_error = 0;
/// Each write, fsync and rename with the path it is of, while this is there.
std::vector<std::string>* calls_made = nullptr;

void Note(const std::string& call, const std::string& path) {
  if (calls_made != nullptr) calls_made->push_back(call + ' ' + path);
}

std::string PathOf(int fd) {
  char path[4096] = {};
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  return ::readlink(link.c_str(), path, sizeof(path) - 1) > 0 ? path : "";
}

bool IsToFail() {
  if (fail_at == 0 || --fail_at > 0) return false;
  errno = fail_error;
  return true;
}

}  // namespace

// These stand before those of the C library, for the shared libraries of this process too.
extern "C" {
__attribute__((visibility("default"))) ssize_t write(int fd, const void* data, size_t size) {
  if (calls_made != nullptr) Note("write", PathOf(fd));
  const size_t taken = write_limit == 0 ? size : std::min(size, write_limit);
  // A run goes on without its log: log_file_test.
  const bool counts = fail_at > 0 && !PathOf(fd).ends_with("/log.txt");
  return counts && IsToFail() ? -1 : syscall(SYS_write, fd, data, taken);
}
__attribute__((visibility("default"))) int flock(int fd, int operation) noexcept {
  if (!no_locks) return static_cast<int>(syscall(SYS_flock, fd, operation));
  errno = ENOLCK;
  return -1;
}
__attribute__((visibility("default"))) int fsync(int fd) {
  // No call of the system: tests need not survive a power cut.
  if (calls_made != nullptr) Note("fsync", PathOf(fd));
  return IsToFail() ? -1 : 0;
}
__attribute__((visibility("default"))) int mkdir(const char* path, mode_t mode) noexcept {
  if (create_error == 0) return static_cast<int>(syscall(SYS_mkdir, path, mode));
  errno = create_error;
  return -1;
}
__attribute__((visibility("default"))) int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if (create_error == 0 || (flags & O_CREAT) == 0) {
    return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
  }
  errno = create_error;
  return -1;
}
__attribute__((visibility("default"))) int rename(const char* from, const char* to) noexcept {
  if (die_at_rename > 0 && --die_at_rename == 0) ::_exit(0);
  if (calls_made != nullptr) Note("rename", from);
  return IsToFail() ? -1
                    : static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
}

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Files and folders at any depth.
std::vector<std::string> EntriesOf(const fs::path& folder) {
  std::vector<std::string> entries;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    entries.push_back(entry.path().lexically_relative(folder).string());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

// FAULTS 92
TEST(OutputFolder, LeavesAnExistingFolderAlone) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  const std::string before = Read(folder / "out/run.json");
  std::string text;
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out"), 5); }, &text), 73);
  EXPECT_EQ(text, (folder / "out").string() + ": exists already; add --force to replace it");
  EXPECT_EQ(Read(folder / "out/run.json"), before);
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out/"), 5); }), 73);
}

TEST(OutputFolder, ALinkToNothingIsCalledOne) {
  const TemporaryFolder folder;
  fs::create_symlink(folder / "nothing", folder / "out");
  for (const bool force : {false, true}) {
    std::string text;
    EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out", force)); }, &text), 73);
    EXPECT_EQ(text, (folder / "out").string() +
                        ": is a link to what does not exist; remove it, or choose another folder");
  }
}

TEST(OutputFolder, ForceReplacesARunFolder) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  EXPECT_EQ(Lines(folder / "out/files.txt"), EntriesOf(folder / "out"));
  Record(OptionsFor(folder / "out", true), 5);
  EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 6u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);  // the old one is gone
}

TEST(OutputFolder, ForceSparesWhatWasNotWrittenWithTheRun) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "runs"), 3);
  const std::string start = (folder / "runs").string() + ": holds what was not written with it: ";
  const auto expect = [&](const std::string& names) {
    std::string text;
    EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "runs", true)); }, &text), 73);
    EXPECT_EQ(text, start + names + "; move that elsewhere, or choose another folder");
    EXPECT_EQ(Lines(folder / "runs/truth.csv").size(), 4u);
  };
  // Another run, be it in a folder of this one.
  Record(OptionsFor(folder / "runs/base"), 3);
  expect("'base'");
  Record(OptionsFor(folder / "runs/ekf/base"), 3);
  expect("'base', 'ekf/base'");
  std::ofstream(folder / "runs/a.txt") << "x";
  fs::create_directory(folder / "runs/empty");
  expect("'a.txt', 'base', 'ekf/base' and 1 more");
  for (const char* name : {"a.txt", "base", "empty", "ekf/base"}) {
    fs::rename(folder / "runs" / name, folder / fs::path(name).filename());
    fs::remove_all(folder / fs::path(name).filename());
  }
  Record(OptionsFor(folder / "runs", true), 5);
  EXPECT_EQ(Lines(folder / "runs/truth.csv").size(), 6u);
}

TEST(OutputFolder, ForceSparesWhatCameWhileTheRunWasAtWork) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  Recorder second(OptionsFor(folder / "out", true), MakeConfig());
  std::ofstream(folder / "out/mine.txt") << "x";
  EXPECT_EQ(CodeOf([&] { second.Finish({}); }), 73);
  EXPECT_EQ(Read(folder / "out/mine.txt"), "x");
}

TEST(OutputFolder, SaysThatAFolderCannotBeRead) {
  const TemporaryFolder folder;
  Host();  // a child without rights could not look for plugins
  Record(OptionsFor(folder / "out"), 3);
  fs::permissions(folder.path(), fs::perms::all);
  for (const char* closed : {"out", "out/files.txt"}) {
    fs::permissions(folder / closed, fs::perms::none);
    const int code = InChild([&] {
      if (::getuid() == 0 && ::setuid(65534) != 0) ::_exit(99);
      std::string text;
      const int refused = CodeOf([&] { Record(OptionsFor(folder / "out", true)); }, &text);
      ::_exit(text.find(": cannot be read: Permission denied;") == text.npos ? 1 : refused);
    });
    fs::permissions(folder / closed, fs::perms::owner_all);
    if (code == 99) GTEST_SKIP() << "cannot give up the rights of root";
    EXPECT_EQ(code, 73) << closed;
  }
}

TEST(OutputFolder, NeedsTheCurrentFolderForARelativeNameOnly) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "gone");
  Host();
  const int code = InChild([&] {
    fs::current_path(folder / "gone");
    fs::remove(folder / "gone");
    std::string text;
    if (CodeOf([&] { Record(OptionsFor("out")); }, &text) != 73) ::_exit(1);
    if (!text.starts_with("out: the current folder is gone; change to one")) ::_exit(2);
    Record(OptionsFor(folder / "out"));
  });
  EXPECT_EQ(code, 0);
  EXPECT_TRUE(fs::exists(folder / "out/run.json"));
}

TEST(OutputFolder, ForceSparesWhatIsNoRunFolder) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "home");
  std::ofstream(folder / "home/thesis.tex") << "x";
  std::ofstream(folder / "file") << "x";
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "home", true)); }), 73);
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "file", true)); }), 73);
  EXPECT_EQ(Read(folder / "home/thesis.tex"), "x");
  fs::remove(folder / "home/thesis.tex");
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "home", true)); }), 0);  // empty
}

// FAULTS 95
TEST(OutputFolder, AFolderBeingWrittenIsRefused) {
  const TemporaryFolder folder;
  const Recorder first(OptionsFor(folder / "out"), MakeConfig());
  std::string text;
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }, &text), 73);
  EXPECT_NE(text.find("process " + std::to_string(::getpid()) + " is writing it now"),
            std::string::npos)
      << text;
  Record(OptionsFor(folder / "other"));  // another name is free
}

TEST(OutputFolder, ALockThatAnotherProgramKeepsDoesNotHoldUpARun) {
  const TemporaryFolder folder;
  Host();
  const int held = ::open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  const int code = InChild([&] {
    ::alarm(60);
    Record(OptionsFor(folder / "out"));
  });
  ::close(held);
  EXPECT_EQ(code, 0);
  EXPECT_TRUE(fs::exists(folder / "out/run.json"));
}

// What a folder that is finished has no use for is there as long as it may fail.
TEST(OutputFolder, AScratchFileGoesLast) {
  const TemporaryFolder folder;
  const auto write = [&](int n) {
    internal::OutputFolder out(folder / "out", false);
    out.Write("a.csv", "1\n");
    out.Write("scratch", "2\n");
    out.Keep();
    fail_at = n;
    fail_error = EIO;
    const int code = CodeOf([&] { out.Commit("scratch"); });
    fail_at = 0;
    return code;
  };
  // A write of the list, and an fsync of each of a.csv, files.txt and the folder; what goes again
  // needs none.
  for (int n = 1; n <= 4; ++n) {
    EXPECT_EQ(write(n), 74) << n;
    const auto failed = internal::FailedFolders(folder / "out");
    ASSERT_EQ(failed.size(), 1u) << n;
    EXPECT_EQ(Read(failed[0] / "scratch"), "2\n") << n;
    fs::remove_all(failed[0]);
  }
  EXPECT_EQ(write(0), 0);
  EXPECT_EQ(FilesIn(folder / "out"), (std::vector<std::string>{"a.csv", "files.txt"}));
  EXPECT_EQ(Lines(folder / "out/files.txt"), (std::vector<std::string>{"a.csv", "files.txt"}));
}

TEST(OutputFolder, ANameThatIsTooLongIsRefusedAtOnce) {
  const TemporaryFolder folder;
  fs::path deep = folder.path();
  for (int i = 0; i < 2500; ++i) deep /= "d";
  std::string text;
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(deep)); }, &text), 73);
  EXPECT_TRUE(text.ends_with(": cannot create: File name too long")) << text;
  EXPECT_FALSE(fs::exists(folder / "d"));
}

/// The hidden folders next to `out`, by name.
std::vector<std::string> HiddenIn(const TemporaryFolder& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.')) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// What a process leaves that is killed while it writes `out`.
void LeavePartialFolder(const TemporaryFolder& folder, bool force = false) {
  const int code = InChild([&] {
    const Recorder recorder(OptionsFor(folder / "out", force), MakeConfig());
    ::_exit(0);
  });
  ASSERT_EQ(code, 0);
}

/// What a process leaves that is killed after it moved the old `out` away, before the new one came.
void LeaveReplacedFolder(const TemporaryFolder& folder) {
  const int code = InChild([&] {
    die_at_rename = 2;
    Record(OptionsFor(folder / "out", true), 5);
    ::_exit(1);
  });
  ASSERT_EQ(code, 0);
  ASSERT_FALSE(fs::exists(folder / "out"));
}

TEST(OutputFolder, RemovesWhatADeadProcessLeft) {
  const TemporaryFolder folder;
  LeavePartialFolder(folder);
  ASSERT_EQ(HiddenIn(folder).size(), 1u);
  Record(OptionsFor(folder / "other"));  // another name
  EXPECT_EQ(HiddenIn(folder).size(), 1u);
  Record(OptionsFor(folder / "out"));
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{});
}

TEST(OutputFolder, RemovesWhatAProcessLeftThatDiedBeforeItsMark) {
  const TemporaryFolder folder;
  const std::string dead = "999999999", living = std::to_string(::getppid());
  for (const std::string& name : {".out.partial-" + dead, ".out.old-" + dead}) {
    fs::create_directory(folder / name);
  }
  std::ofstream(folder / (".out.old-" + dead) / ".alidade");
  fs::create_directory(folder / (".out.partial-" + living));
  fs::create_directory(folder / ".out.partial-notes");
  Record(OptionsFor(folder / "out"));
  EXPECT_EQ(HiddenIn(folder),
            (std::vector<std::string>{".out.partial-" + living, ".out.partial-notes"}));
}

// As in a container, where each process has the number of the one before.
TEST(OutputFolder, KeepsTheRowsOfProcessesOfOneNumberApart) {
  const TemporaryFolder folder;
  const std::string name = "out.failed-" + std::to_string(::getpid());
  for (int i = 0; i < 3; ++i) {
    Experiment experiment = MakeExperiment(5);
    Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
    static_cast<void>(RunInto(recorder, experiment));
  }
  fs::create_directory(folder / (name + "-mine"));
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{});
  EXPECT_EQ(internal::FailedFolders(folder / "out"),
            (std::vector<fs::path>{folder / name, folder / (name + "-2"), folder / (name + "-3")}));
}

TEST(OutputFolder, KeepsTheRowsThatADeadProcessLeft) {
  const TemporaryFolder folder;
  const int code = InChild([&] {
    Experiment experiment = MakeExperiment(5);
    Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
    static_cast<void>(RunInto(recorder, experiment));
    ::_exit(0);
  });
  ASSERT_EQ(code, 0);
  const std::string hidden = HiddenIn(folder).at(0);
  const std::string process = hidden.substr(hidden.rfind('-') + 1);
  Record(OptionsFor(folder / "out"));
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{});
  EXPECT_TRUE(fs::exists(folder / ("out.failed-" + process) / "config.resolved.yaml"));
  EXPECT_FALSE(fs::exists(folder / ("out.failed-" + process) / ".alidade"));
  Record(OptionsFor(folder / "out", true));
  EXPECT_TRUE(fs::exists(folder / ("out.failed-" + process))) << "--force replaces DIR alone";
}

TEST(OutputFolder, TouchesNoFolderThatItDidNotMake) {
  const std::vector<std::string> mine = {".out.old-1", ".out.old-2024", ".out.partial-1",
                                         ".out.partial-999999999", ".out.partial-notes"};
  const TemporaryFolder folder;
  for (const std::string& name : mine) {
    fs::create_directory(folder / name);
    std::ofstream(folder / name / "notes.txt") << name;
  }
  const auto expect_untouched = [&](const char* when) {
    EXPECT_EQ(HiddenIn(folder), mine) << when;
    for (const std::string& name : mine) EXPECT_EQ(Read(folder / name / "notes.txt"), name) << when;
  };
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }), 0);
  expect_untouched("a new folder");
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }), 73);
  expect_untouched("refused");
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out", true)); }), 0);
  expect_untouched("replaced");
}

TEST(OutputFolder, TouchesNoLeftoverUnderAnotherName) {
  const TemporaryFolder folder;
  LeavePartialFolder(folder);
  fs::rename(folder / HiddenIn(folder).at(0), folder / ".out.partial-999999999");  // by the user
  Record(OptionsFor(folder / "out"));
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{".out.partial-999999999"});
}

TEST(OutputFolder, TouchesNoLeftoverWhereTheRunIsRefused) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  LeavePartialFolder(folder, true);
  const std::vector<std::string> before = EntriesOf(folder.path());
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }), 73);
  std::ofstream(folder / "out/mine.txt") << "x";
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out", true)); }), 73);
  fs::remove(folder / "out/mine.txt");
  EXPECT_EQ(EntriesOf(folder.path()), before);
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out", true)); }), 0);
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{});
}

TEST(OutputFolder, WithoutLocksALivingProcessHoldsItsFolder) {
  const TemporaryFolder folder;
  LeavePartialFolder(folder);
  no_locks = true;
  std::string text;
  const int dead = CodeOf([&] { Record(OptionsFor(folder / "out")); });
  const Recorder first(OptionsFor(folder / "held"), MakeConfig());
  const int living = CodeOf([&] { Record(OptionsFor(folder / "held")); }, &text);
  no_locks = false;
  EXPECT_EQ(dead, 0);
  const std::string process = std::to_string(::getpid());
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{".held.partial-" + process});
  EXPECT_EQ(living, 73);
  EXPECT_NE(text.find("process " + process + " is writing it now"), std::string::npos) << text;
}

TEST(OutputFolder, KeepsWhatADeadProcessWasReplacingUnlessForced) {
  const TemporaryFolder folder;
  Record(OptionsFor(folder / "out"), 3);
  LeaveReplacedFolder(folder);
  const std::vector<std::string> before = EntriesOf(folder.path());
  std::string text;
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out")); }, &text), 73);
  EXPECT_NE(text.find("died while it replaced it: the old folder is '"), std::string::npos) << text;
  EXPECT_EQ(EntriesOf(folder.path()), before);
  { const Recorder unfinished(OptionsFor(folder / "out", true), MakeConfig()); }
  EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 4u);  // it is back in its place
  EXPECT_EQ(Lines(folder / "out/files.txt"), EntriesOf(folder / "out"));
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{});
  LeaveReplacedFolder(folder);
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out", true), 5); }), 0);
  EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 6u);
  EXPECT_EQ(HiddenIn(folder), std::vector<std::string>{});
}

TEST(OutputFolder, WritesWhereALinkPoints) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "disk/runs");
  fs::create_directory_symlink("disk/runs", folder / "out");
  EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out"), 3); }), 73);
  for (const int frames : {3, 5}) {
    EXPECT_EQ(CodeOf([&] { Record(OptionsFor(folder / "out", true), frames); }), 0);
    EXPECT_TRUE(fs::is_symlink(folder / "out"));
    EXPECT_EQ(Lines(folder / "disk/runs/truth.csv").size(), 1u + frames);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "disk"), {}), 1);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2);
  }
}

TEST(OutputFolder, LeavesNothingWithoutFinish) {
  const TemporaryFolder folder;
  {
    Recorder recorder(OptionsFor(folder / "above/out"), MakeConfig());
    EXPECT_FALSE(folder.empty());
  }
  EXPECT_TRUE(folder.empty());
}

TEST(OutputFile, TakesNoMoreAfterAFailure) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; text.size() < 70'000; ++i) text += std::to_string(i) + '\n';
  internal::OutputFile file(folder / "file", "file");
  write_limit = 1000;
  fail_at = 4;
  fail_error = ENOSPC;
  const int code = CodeOf([&] { file.Write(text); });
  fail_at = 0;
  write_limit = 0;
  EXPECT_EQ(code, 74);
  EXPECT_EQ(Read(folder / "file"), "") << "the text was not whole";
  EXPECT_EQ(CodeOf([&] {
              file.Write("next\n");
              file.Close();
            }),
            74);
  EXPECT_EQ(Read(folder / "file"), "");
}

TEST(OutputFile, EndsWithTheLastRowThatFitsIn) {
  const TemporaryFolder folder;
  internal::OutputFile file(folder / "file", "file");
  std::string rows;
  for (int i = 100; i < 400; ++i) {
    rows += std::to_string(i) + '\n';
    file.Write(std::to_string(i) + '\n');
  }
  write_limit = 111;
  fail_at = 8;
  fail_error = ENOSPC;
  const int code = CodeOf([&] { file.Close(); });
  fail_at = 0;
  write_limit = 0;
  EXPECT_EQ(code, 74);
  EXPECT_EQ(Read(folder / "file"), rows.substr(0, 7 * 111 / 4 * 4));
}

TEST(OutputFile, RowsDoNotWaitForLongerThanASecond) {
  const TemporaryFolder folder;
  internal::OutputFile file(folder / "file", "file");
  file.Write("1\n");
  EXPECT_EQ(Read(folder / "file"), "");
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  file.Write("2\n");
  EXPECT_EQ(Read(folder / "file"), "1\n2\n");
}

// FAULTS 87: a disk or quota that is full is no matter of rights.
TEST(OutputFolder, WhatCannotBeCreatedHasTheCodeOfItsCause) {
  for (const auto& [error, expected] :
       {std::pair(ENOSPC, 74), {EDQUOT, 74}, {EIO, 74}, {EACCES, 73}, {EROFS, 73}}) {
    const TemporaryFolder folder;
    create_error = error;
    std::string of_file, of_folder;
    const int file = CodeOf([&] { internal::OutputFile(folder / "file", "file"); }, &of_file);
    const int made = CodeOf([&] { internal::OutputFolder(folder / "out", false); }, &of_folder);
    create_error = 0;
    EXPECT_EQ(file, expected) << of_file;
    EXPECT_EQ(made, expected) << of_folder;
    EXPECT_TRUE(of_file.starts_with("file: cannot create: ")) << of_file;
    EXPECT_TRUE(of_folder.starts_with((folder / "out").string() + ": cannot create: "))
        << of_folder;
  }
}

// A power cut leaves no file with a part of what was written.
TEST(OutputFolder, EveryFileIsSyncedAfterItsLastWriteAndBeforeItsFolderTakesItsName) {
  const TemporaryFolder folder;
  std::vector<std::string> calls;
  Experiment experiment = MakeExperiment(5);
  calls_made = &calls;
  Recorder recorder(OptionsFor(folder / "out"), MakeConfig());
  recorder.Finish(RunInto(recorder, experiment));
  calls_made = nullptr;
  const auto renamed = std::ranges::find_if(
      calls, [](const std::string& call) { return call.starts_with("rename "); });
  ASSERT_NE(renamed, calls.end());
  const std::string partial = renamed->substr(std::string("rename ").size());
  const auto last = [&](const std::string& call) {
    return std::ranges::find(calls.rbegin(), calls.rend(), call);  // before base() it is
  };
  for (const std::string& name : FilesIn(folder / "out")) {
    const std::string path = partial + '/' + name;
    const auto written = last("write " + path), synced = last("fsync " + path);
    ASSERT_NE(written, calls.rend()) << path;
    ASSERT_NE(synced, calls.rend()) << path;
    EXPECT_LT(written.base(), synced.base()) << path;
    EXPECT_LT(synced.base(), renamed + 1) << path;
  }
  EXPECT_LT(last("fsync " + partial).base(), renamed + 1);
  EXPECT_EQ(calls.back(), "fsync " + folder.path().string());
}

// FAULTS 87: every write, fsync and rename in turn, on a new folder and on one to be replaced.
TEST(OutputFolder, EveryFailureOfTheDiskIsAnErrorThatKeepsTheRows) {
  for (const bool replace : {false, true}) {
    const TemporaryFolder folder;
    const fs::path failed_folder = folder / ("out.failed-" + std::to_string(::getpid()));
    if (replace) Record(OptionsFor(folder / "out"), 3);
    int calls = 0, kept = 0, without_report = 0;
    for (int n = 1; n < 200; ++n) {
      fail_at = n;
      fail_error = n % 2 == 0 ? ENOSPC : EIO;
      std::string text;
      const int code = CodeOf([&] { Record(OptionsFor(folder / "out", true), 5); }, &text);
      const bool failed = fail_at <= 0;
      fail_at = 0;
      if (!failed) {
        EXPECT_EQ(code, 0) << text;
        calls = n - 1;
        break;
      }
      ASSERT_TRUE(code == 74) << "call " << n << ": " << code << ' ' << text;
      EXPECT_TRUE(text.starts_with((folder / "out").string())) << text;
      EXPECT_NE(text.find(n % 2 == 0 ? "No space left on device" : "Input/output error"),
                std::string::npos)
          << text;
      if (fs::exists(failed_folder)) {
        ++kept;
        for (const std::string& name : FilesIn(failed_folder)) {
          if (!name.ends_with(".csv")) continue;
          const std::string rows = Read(failed_folder / name);
          EXPECT_TRUE(rows.empty() || rows.back() == '\n') << "call " << n << ": " << name;
        }
        fs::remove_all(failed_folder);
      } else if (fs::exists(folder / "out") && !fs::exists(folder / "out/report.html")) {
        ++without_report;
        EXPECT_NE(text.find("report.html"), std::string::npos) << text;
        EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 6u);
        EXPECT_EQ(Lines(folder / "out/files.txt"), EntriesOf(folder / "out"));
        fs::remove_all(folder / "out");
        if (replace) Record(OptionsFor(folder / "out"), 3);
        continue;
      }
      if (replace && fs::exists(folder / "out") && Lines(folder / "out/truth.csv").size() == 6) {
        // The last fsync, of the folder above: the new one is in its place, the old one next to it.
        EXPECT_NE(text.find("cannot sync"), std::string::npos) << text;
        for (const auto& entry : fs::directory_iterator(folder.path())) fs::remove_all(entry);
        Record(OptionsFor(folder / "out"), 3);
      } else if (replace) {
        EXPECT_EQ(FilesIn(folder.path()).size(), 22u) << "call " << n;
        EXPECT_EQ(Lines(folder / "out/truth.csv").size(), 4u);
      } else if (!folder.empty()) {
        EXPECT_EQ(FilesIn(folder.path()).size(), 22u) << "call " << n;
        fs::remove_all(folder / "out");
      }
    }
    EXPECT_GT(calls, 30);
    EXPECT_GT(kept, 20);
    EXPECT_GT(without_report, 0);
  }
}

// FAULTS 87, 91: whatever the disk failed at, once and in the run that resumes too.
TEST(OutputFolder, ARunThatResumesAfterAnyFailureOfTheDiskHasTheSameBytes) {
  const auto options = [](const TemporaryFolder& folder, bool resume) {
    Recorder::Options all = OptionsFor(folder / "out");
    all.inputs = internal::InputsJson({{"run"}, {}, {}}, MakeConfig(), {}, {});
    all.resume = resume;
    return all;
  };
  const TemporaryFolder whole;
  Record(options(whole, false), 5);
  int kept = 0, calls = 0;
  for (int n = 1; n < 200; ++n) {
    const TemporaryFolder folder;
    for (const bool resume : {false, true}) {
      if (internal::StatusOf(folder / "out") == internal::FolderStatus::kFinished) continue;
      fail_at = n;
      fail_error = ENOSPC;
      static_cast<void>(CodeOf([&] { Record(options(folder, resume), 5); }));
      calls += fail_at <= 0 ? 1 : 0;
      fail_at = 0;
      kept += internal::FailedFolders(folder / "out").empty() ? 0 : 1;
    }
    if (internal::StatusOf(folder / "out") != internal::FolderStatus::kFinished) {
      std::string text;
      EXPECT_EQ(CodeOf([&] { Record(options(folder, true), 5); }, &text), 0) << n << ": " << text;
      EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << n;
    }
    ASSERT_EQ(FilesIn(folder / "out"), FilesIn(whole / "out")) << n;
    for (const std::string& name : FilesIn(whole / "out")) {
      if (internal::HasWallClock(name)) continue;
      EXPECT_EQ(Read(folder / "out" / name), Read(whole / "out" / name)) << n << ": " << name;
    }
    if (calls == 0) break;
    calls = 0;
  }
  EXPECT_GT(kept, 20);
}

// FAULTS 87: the folder of a sweep.
TEST(OutputFolder, EveryFailureOfTheDiskIsAnErrorForASweepToo) {
  const Config config = MakeConfig();
  SweepResult result;
  result.runs = 1;
  result.estimators = {"ekf"};
  EstimatorResult one;
  one.name = "ekf";
  one.metrics["rmse:depth"] = 0.5;
  result.done.emplace_back().estimators.emplace_back(one);
  const TemporaryFolder folder;
  int calls = 0;
  for (int n = 1; n < 100; ++n) {
    fail_at = n;
    fail_error = n % 2 == 0 ? EDQUOT : EIO;
    std::string text;
    const auto write = [&] {
      SweepFolder(folder / "out", false).Write(result, Summarise(result), config);
    };
    const int code = CodeOf(write, &text);
    const bool failed = fail_at <= 0;
    fail_at = 0;
    if (!failed) {
      EXPECT_EQ(code, 0) << text;
      break;
    }
    ++calls;
    ASSERT_EQ(code, 74) << "call " << n << ": " << text;
    EXPECT_TRUE(text.starts_with((folder / "out").string())) << text;
    if (!folder.empty()) {
      // The last fsync, of the folder above: all is in its place.
      EXPECT_NE(text.find("cannot sync"), std::string::npos) << text;
      EXPECT_EQ(Lines(folder / "out/files.txt"), EntriesOf(folder / "out"));
      fs::remove_all(folder / "out");
    }
  }
  EXPECT_GT(calls, 10);
}

// FAULTS 88
TEST(OutputFolder, ALimitOnTheFileSizeIsAnErrorNotTheEnd) {
  const TemporaryFolder folder;
  const int code = InChild([&] {
    const rlimit limit{2000, 2000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    Record(OptionsFor(folder / "out"));
  });
  EXPECT_EQ(code, 74);
  ASSERT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
  const fs::path kept = fs::directory_iterator(folder.path())->path();
  EXPECT_TRUE(kept.filename().string().starts_with("out.failed-")) << kept;
  EXPECT_EQ(Read(kept / "truth.csv").back(), '\n');
}

// FAULTS 93
TEST(OutputFolder, AFolderThatCannotBeWrittenToIsRefused) {
  const TemporaryFolder folder;
  Host();  // a child without rights could not look for plugins
  fs::create_directories(folder / "mine");
  fs::permissions(folder.path(), fs::perms(0755));
  fs::permissions(folder / "mine", fs::perms(0555));
  const int code = InChild([&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) ::_exit(99);
    Record(OptionsFor(folder / "mine/deep/out"));
  });
  if (code == 99) GTEST_SKIP() << "cannot give up the rights of root";
  EXPECT_EQ(code, 73);
  EXPECT_TRUE(fs::is_empty(folder / "mine"));
}

}  // namespace
}  // namespace alidade
