// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/output_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "support/recording.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project
using internal::OutputFile;
using internal::OutputFolder;

/// Returns the paths of all files and folders in `folder`, at any depth.
std::vector<std::string> EntriesOf(const fs::path& folder) {
  std::vector<std::string> entries;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    entries.push_back(entry.path().lexically_relative(folder).string());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

/// Leaves a partial folder, like a process that is killed after it has written a file.
void LeavePartial(const fs::path& target, const std::string& text = "rows\n") {
  OutputFolder folder(target, false);
  folder.Write("ekf/a.csv", text);
  folder.Retain();
}

void Complete(const fs::path& target, bool force, const std::string& text) {
  OutputFolder folder(target, force);
  folder.Write("ekf/a.csv", text);
  folder.Commit();
}

TEST(OutputFolder, IsPartialUntilItIsComplete) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "runs/out", partial = temporary / "runs/out.partial";
  OutputFolder folder(out / "", false);
  folder.Write("ekf/a.csv", "1\n");
  EXPECT_EQ(folder.partial(), partial);
  EXPECT_EQ(Read(partial / "ekf/a.csv"), "1\n");
  EXPECT_FALSE(fs::exists(out));
  folder.Commit();
  EXPECT_FALSE(fs::exists(partial));
  EXPECT_EQ(EntriesOf(out), (std::vector<std::string>{"ekf", "ekf/a.csv", "files.txt"}));
  EXPECT_EQ(Lines(out / "files.txt"), EntriesOf(out));
}

TEST(OutputFolder, StaysPartialOnlyIfItIsToBeKept) {
  const TemporaryFolder temporary;
  { OutputFolder(temporary / "out", false).Write("a.csv", "1\n"); }
  EXPECT_TRUE(temporary.empty());
  LeavePartial(temporary / "out");
  EXPECT_EQ(Read(temporary / "out.partial/ekf/a.csv"), "rows\n");
}

// Tests fault 92 of tests/faults/README.md.
TEST(OutputFolder, LeavesAnExistingFolderAlone) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "out";
  Complete(out, false, "old\n");
  std::string text;
  EXPECT_EQ(CodeOf([&] { OutputFolder(out, false); }, &text), 73);
  EXPECT_EQ(text, out.string() + ": exists already; add --force to replace it");
  EXPECT_EQ(CodeOf([&] { OutputFolder(out / "", false); }), 73);
  EXPECT_EQ(Read(out / "ekf/a.csv"), "old\n");
}

// Tests faults 91 and 92 of tests/faults/README.md.
TEST(OutputFolder, LeavesAnExistingPartialFolderAlone) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "out";
  LeavePartial(out);
  std::string text;
  EXPECT_EQ(CodeOf([&] { OutputFolder(out, false); }, &text), 73);
  EXPECT_EQ(text, (temporary / "out.partial").string() +
                      ": exists already: another command ended before it completed this folder, "
                      "or is still running; add --force to replace this folder, or remove it");
  EXPECT_EQ(Read(temporary / "out.partial/ekf/a.csv"), "rows\n");
  Complete(out, true, "new\n");
  EXPECT_EQ(Read(out / "ekf/a.csv"), "new\n");
  EXPECT_FALSE(fs::exists(temporary / "out.partial"));
}

TEST(OutputFolder, IsContinuedIfAsked) {
  const TemporaryFolder temporary;
  LeavePartial(temporary / "out");
  {
    OutputFolder folder(temporary / "out", false, true);
    folder.Append("ekf/a.csv")->Write("more\n");
  }
  EXPECT_EQ(Read(temporary / "out.partial/ekf/a.csv"), "rows\nmore\n")
      << "the existing file must not change";
  OutputFolder(temporary / "out", false, true).Commit();
  EXPECT_EQ(Lines(temporary / "out/files.txt"), EntriesOf(temporary / "out"));
}

TEST(OutputFolder, DoesNotListWhatSomebodyElsePutIntoIt) {
  const TemporaryFolder temporary;
  OutputFolder folder(temporary / "out", false);
  folder.Write("ekf/a.csv", "rows\n");
  fs::create_directory(temporary / "out.partial/notes");
  std::ofstream(temporary / "out.partial/notes/mine.txt") << "mine\n";
  folder.Commit();
  EXPECT_EQ(Lines(temporary / "out/files.txt"),
            (std::vector<std::string>{"ekf", "ekf/a.csv", "files.txt"}));
  EXPECT_EQ(CodeOf([&] { OutputFolder(temporary / "out", true); }), 73);
}

TEST(OutputFolder, IsNotCompletedIfAnotherCommandHasReplacedIt) {
  const TemporaryFolder temporary;
  OutputFolder first(temporary / "out", false);
  first.Write("a.csv", "first\n");
  OutputFolder second(temporary / "out", true);
  second.Write("a.csv", "second\n");
  EXPECT_EQ(CodeOf([&] { first.Commit(); }), 73);
  second.Commit();
  EXPECT_EQ(Read(temporary / "out/a.csv"), "second\n");
}

TEST(OutputFolder, ForceReplacesAFolderWhenTheNewOneIsComplete) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "out";
  Complete(out, false, "old\n");
  OutputFolder folder(out, true);
  folder.Write("b.csv", "new\n");
  EXPECT_EQ(Read(out / "ekf/a.csv"), "old\n");
  folder.Commit();
  EXPECT_EQ(EntriesOf(out), (std::vector<std::string>{"b.csv", "files.txt"}));
  EXPECT_EQ(std::distance(fs::directory_iterator(temporary.path()), {}), 1);
}

TEST(OutputFolder, ForceSparesWhatWasNotWrittenWithIt) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "out";
  Complete(out, false, "old\n");
  LeavePartial(temporary / "left");
  for (const fs::path& folder : {out, temporary / "left.partial"}) {
    const auto expect = [&](const std::string& names) {
      std::string text;
      const fs::path target = folder == out ? out : temporary / "left";
      EXPECT_EQ(CodeOf([&] { OutputFolder(target, true); }, &text), 73);
      EXPECT_EQ(text, folder.string() + ": contains files that alidade did not write: " + names +
                          "; move them, or choose another folder");
    };
    Complete(folder / "ekf/run", false, "another\n");
    expect("'ekf/run'");
    std::ofstream(folder / "notes.txt") << "x";
    fs::create_directories(folder / "empty/deep");
    std::ofstream(folder / "zebra.txt") << "x";
    expect("'ekf/run', 'empty', 'notes.txt' and 1 more");
    EXPECT_TRUE(fs::exists(folder / "ekf/a.csv"));
  }
}

TEST(OutputFolder, ForceSparesWhatCameWhileTheRunWasAtWork) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "out";
  Complete(out, false, "old\n");
  OutputFolder folder(out, true);
  std::ofstream(out / "mine.txt") << "x";
  std::string text;
  EXPECT_EQ(CodeOf([&] { folder.Commit(); }, &text), 73);
  EXPECT_TRUE(text.ends_with("; the new folder is " + (temporary / "out.partial").string()))
      << text;
  EXPECT_EQ(Read(out / "mine.txt"), "x");
  EXPECT_TRUE(fs::exists(temporary / "out.partial"));
}

TEST(OutputFolder, ForceSparesWhatIsNoRunFolder) {
  const TemporaryFolder temporary;
  fs::create_directories(temporary / "home.partial");
  for (const char* name : {"thesis.tex", "home.partial/thesis.tex"}) {
    std::ofstream(temporary / name) << "x";
  }
  for (const char* name : {"home", "thesis.tex"}) {
    EXPECT_EQ(CodeOf([&] { OutputFolder(temporary / name, true); }), 73) << name;
  }
  EXPECT_EQ(Read(temporary / "home.partial/thesis.tex"), "x");
  fs::remove(temporary / "home.partial/thesis.tex");
  EXPECT_EQ(CodeOf([&] { OutputFolder(temporary / "home", true); }), 0)
      << "an empty partial folder is replaced";
}

// Files that other writers added, such as images and figures, also belong to the folder.
TEST(OutputFolder, ForceReplacesWhatWasAddedToIt) {
  const TemporaryFolder temporary;
  {
    OutputFolder folder(temporary / "out", false);
    std::ofstream(folder.Add("images/left/") / "000001.png") << "x";
    std::ofstream(folder.Add("videos/run.avi")) << "x";
    folder.Retain();
  }
  Complete(temporary / "out", true, "new\n");
  EXPECT_EQ(EntriesOf(temporary / "out"),
            (std::vector<std::string>{"ekf", "ekf/a.csv", "files.txt"}));
}

TEST(OutputFolder, WritesWhereALinkPoints) {
  const TemporaryFolder temporary;
  fs::create_directories(temporary / "disk/runs");
  fs::create_directory_symlink("disk/runs", temporary / "out");
  fs::create_symlink(temporary / "nothing", temporary / "dangling");
  EXPECT_EQ(CodeOf([&] { OutputFolder(temporary / "out", false); }), 73);
  for (const std::string text : {"1\n", "2\n"}) {
    Complete(temporary / "out", true, text);
    EXPECT_TRUE(fs::is_symlink(temporary / "out"));
    EXPECT_EQ(Read(temporary / "disk/runs/ekf/a.csv"), text);
    EXPECT_EQ(std::distance(fs::directory_iterator(temporary / "disk"), {}), 1);
  }
  std::string text;
  EXPECT_EQ(CodeOf([&] { OutputFolder(temporary / "dangling", true); }, &text), 73);
  EXPECT_TRUE(text.find(": is a link to a missing file; ") != text.npos) << text;
}

TEST(OutputFolder, NeedsAName) {
  for (const char* name : {"", "/"}) {
    std::string text;
    EXPECT_EQ(CodeOf([&] { OutputFolder(name, true); }, &text), 73);
    EXPECT_TRUE(text.ends_with("is not a valid folder name; expected PATH/NAME")) << text;
  }
  EXPECT_EQ(internal::PartialOf("."), fs::current_path().string() + ".partial");
  EXPECT_EQ(internal::PartialOf("a/../b/"), "b.partial");
}

// Tests fault 93 of tests/faults/README.md.
TEST(OutputFolder, AFolderThatCannotBeWrittenToIsRefused) {
  const TemporaryFolder temporary;
  fs::create_directories(temporary / "mine");
  fs::permissions(temporary.path(), fs::perms(0755));
  fs::permissions(temporary / "mine", fs::perms(0555));
  const int code = InChild([&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) ::_exit(99);
    OutputFolder(temporary / "mine/deep/out", false);
  });
  if (code == 99) GTEST_SKIP() << "this process cannot drop the privileges of root";
  EXPECT_EQ(code, 73);
  EXPECT_TRUE(fs::is_empty(temporary / "mine"));
}

// Tests fault 87 of tests/faults/README.md.
TEST(OutputFile, TakesNoMoreAfterAFailure) {
  OutputFile file("/dev/full");
  file.Write("1\n");
  std::string text;
  EXPECT_EQ(CodeOf([&] { file.Flush(); }, &text), 74);
  EXPECT_EQ(text, "/dev/full: cannot write: No space left on device");
  EXPECT_EQ(CodeOf([&] { file.Close(); }, &text), 74);
  EXPECT_EQ(text, "/dev/full: cannot write: No space left on device");
}

// Tests fault 87 of tests/faults/README.md: a full disk or quota is not reported as an error of
// permissions.
TEST(OutputFile, WhatCannotBeCreatedHasTheCodeOfItsCause) {
  for (const auto& [error, code] :
       {std::pair(ENOSPC, 74), {EDQUOT, 74}, {EIO, 74}, {EACCES, 73}, {EROFS, 73}}) {
    EXPECT_EQ(CodeOf([&] { internal::FailCreate("file", error); }), code) << error;
  }
}

TEST(Recorder, SaysThatItIsRunning) {
  const TemporaryFolder temporary;
  Experiment experiment = MakeExperiment(3);
  Recorder recorder(OptionsFor(temporary / "out"), MakeConfig());
  const std::string running = Read(temporary / "out.partial/run.json");
  EXPECT_NE(running.find("\"status\": \"running\""), running.npos) << running;
  recorder.Finish(RunInto(recorder, experiment));
  const std::string ok = Read(temporary / "out/run.json");
  EXPECT_NE(ok.find("\"status\": \"ok\""), ok.npos) << ok;
}

// Tests fault 87 of tests/faults/README.md: only one of the files is on a full disk.
TEST(Recorder, AFullDiskKeepsTheRows) {
  const TemporaryFolder temporary;
  const fs::path partial = temporary / "out.partial";
  std::string text;
  const int code = CodeOf(
      [&] {
        Experiment experiment = MakeExperiment(3);
        Recorder recorder(OptionsFor(temporary / "out"), MakeConfig());
        fs::create_directories(partial / "ekf");
        fs::create_symlink("/dev/full", partial / "ekf/innovations.csv");
        recorder.Finish(RunInto(recorder, experiment));
      },
      &text);
  EXPECT_EQ(code, 74);
  EXPECT_EQ(text,
            (partial / "ekf/innovations.csv").string() + ": cannot write: No space left on device");
  EXPECT_FALSE(fs::exists(temporary / "out"));
  EXPECT_EQ(Lines(partial / "truth.csv").size(), 4u);
  EXPECT_EQ(Lines(partial / "ekf/estimates.csv").size(), 4u);
  const std::string record = Read(partial / "run.json");
  EXPECT_NE(record.find("\"status\": \"failed\""), record.npos) << record;
  EXPECT_NE(record.find("ekf/innovations.csv: cannot write"), record.npos) << record;
}

}  // namespace
}  // namespace alidade
