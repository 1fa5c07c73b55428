// SPDX-License-Identifier: Apache-2.0
//
// One call of the C library fails in a run, whichever: fail_nth.cc. A few of them here, from the
// first to the last; all of them, but for memory, where ALIDADE_EVERY_FAILURE is set.
#include <algorithm>
#include <cstdint>
#include <random>
#include <set>

#include "alidade/resume/replay.h"
#include "support/program.h"
#include "support/sanitized.h"

namespace alidade::testing {
namespace {

class NthFailure : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (kSanitized) GTEST_SKIP() << "a sanitizer has calls of its own";
    ASSERT_EQ(Call(kRun).code, 0);
    fs::rename(folder_ / "out", folder_ / "whole");
  }

  /// Runs with the `at`-th call failing. Returns how many calls there were.
  std::int64_t RunWith(const std::string& call, std::int64_t at) {
    std::int64_t numbers[2] = {at, 0};
    Write("calls", std::string(reinterpret_cast<const char*>(numbers), sizeof numbers));
    before_ = "ulimit -c 0; export FAIL_CALL=" + call +
              " FAIL_FILE=calls LD_PRELOAD=" ALIDADE_BINARY_DIR "/tests/preloaded/fail_nth.so";
    run_ = Call(kRun);
    std::ifstream(folder_ / "calls", std::ios::binary)
        .read(reinterpret_cast<char*>(numbers), sizeof numbers);
    return numbers[1];
  }

  /// Whether `out` has all that the run without a failure wrote; the log may lack, and of a run
  /// that says so the report.
  void ExpectWhole() const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "whole")) {
      const std::string name = entry.path().lexically_relative(folder_ / "whole");
      if (entry.is_directory() || name == "log.txt" || name == "files.txt") continue;
      if (internal::HasWallClock(name)) continue;
      if (name == "report.html" && run_.code != 0 && !Exists("out/" + name)) continue;
      EXPECT_EQ(Read("out/" + name), Read("whole/" + name)) << name;
    }
  }
  /// Rows of what was kept under another name.
  void ExpectWholeRows(const fs::path& folder) const {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.path().extension() != ".csv" || entry.file_size() == 0) continue;
      EXPECT_EQ(ReadText(entry.path()).back(), '\n') << entry.path();
    }
  }
  /// That the run ended as docs/cli.md says, and left no half of anything under its name.
  void ExpectGoodEnd(const std::set<int>& codes) {
    EXPECT_EQ(run_.signal, 0) << run_.err;
    EXPECT_TRUE(codes.contains(run_.code)) << run_.code << ": " << run_.err;
    EXPECT_FALSE(Contains(run_.err, "internal:")) << run_.err;
    EXPECT_TRUE(run_.code == 0 || Contains(run_.err, "error: ")) << run_.code << run_.err;
    EXPECT_TRUE(run_.code != 70 || Contains(run_.err, "out of memory")) << run_.err;
    ASSERT_TRUE(run_.code != 0 || Exists("out"));
    // What memory ran out for has a folder that says so.
    const bool failed = Contains(Read("out/run.json"), "\"status\": \"failed\"");
    if (Exists("out") && !failed) ExpectWhole();
    std::vector<fs::path> left;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename();
      if (name.starts_with("out") || name.starts_with(".out.")) left.push_back(entry);
    }
    for (const fs::path& folder : left) {
      ExpectWholeRows(folder);
      fs::remove_all(folder);
    }
  }

  /// Lets each of some calls fail: `most` of them, or all.
  void Try(const std::string& call, std::int64_t most, const std::set<int>& codes) {
    const std::int64_t all = RunWith(call, 0);
    ASSERT_EQ(run_.code, 0) << run_.err;
    ASSERT_GT(all, 0) << "no call of " << call;
    ExpectGoodEnd({0});
    const bool every = std::getenv("ALIDADE_EVERY_FAILURE") != nullptr;
    if (every) most = call == "malloc" ? 40 * most : all;
    std::set<std::int64_t> at = {1, all};
    std::mt19937_64 engine(20260101);
    while (std::ssize(at) < std::min(most, all)) {
      at.insert(1 + static_cast<std::int64_t>(engine() % static_cast<std::uint64_t>(all)));
    }
    int failed = 0;
    for (const std::int64_t n : at) {
      SCOPED_TRACE(call + ' ' + std::to_string(n) + " of " + std::to_string(all));
      RunWith(call, n);
      ExpectGoodEnd(codes);
      failed += run_.code != 0 ? 1 : 0;
      if (HasFailure()) break;
    }
    // Without a fork plugins are tried in another one, or they are of no use to this run.
    EXPECT_TRUE(failed > 0 || call == "fork") << "of " << at.size();
  }

  const Arguments kRun = {"run",   "config.yaml",          "-o", "out", "--no-figures",
                          "--set", "source.duration_s=0.5"};
  Outcome run_;
};

// 99
TEST_F(NthFailure, OfOpenIsAnErrorOrNotMissed) { Try("open", 12, {0, 66, 69, 73, 74}); }

// 87
TEST_F(NthFailure, OfWriteIsAnErrorOrNotMissed) { Try("write", 12, {0, 69, 73, 74}); }

// 87
TEST_F(NthFailure, OfFsyncIsAnError) { Try("fsync", 6, {74}); }

// 87
TEST_F(NthFailure, OfRenameIsAnError) { Try("rename", 4, {73, 74}); }

TEST_F(NthFailure, OfForkIsARefusedPluginOrNotMissed) { Try("fork", 6, {0, 69}); }

// 96
TEST_F(NthFailure, OfMallocIsOutOfMemory) { Try("malloc", 16, {0, 69, 70}); }

}  // namespace
}  // namespace alidade::testing
