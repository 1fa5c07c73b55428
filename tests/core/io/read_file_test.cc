// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/read_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <optional>
#include <utility>

#include "support/temporary_folder.h"

namespace alidade {
namespace {

using internal::ReadFile;
using testing::TemporaryFolder;

class FileReader : public ::testing::Test {
 protected:
  internal::ReadFailure fail_ = [this](ExitCode code, int error) { failure_ = {code, error}; };
  std::optional<std::pair<ExitCode, int>> failure_;
  TemporaryFolder folder_;
};

TEST_F(FileReader, GivesEveryByteOrTheFirst) {
  std::string bytes(100'000, 'x');
  bytes[3] = '\0';
  std::ofstream(folder_ / "a") << bytes;
  EXPECT_EQ(ReadFile(folder_ / "a", fail_), bytes);
  EXPECT_EQ(ReadFile(folder_ / "a", fail_, 20'000), bytes.substr(0, 20'000));
  EXPECT_EQ(ReadFile(folder_ / "a", fail_, bytes.size()), bytes);
  EXPECT_FALSE(failure_);
}

TEST_F(FileReader, TellsWhyAFileCannotBeOpened) {
  EXPECT_EQ(ReadFile(folder_ / "none", fail_), "");
  EXPECT_EQ(failure_, std::pair(ExitCode::kInputMissing, ENOENT));
  EXPECT_EQ(ReadFile(folder_.path(), fail_), "");
  EXPECT_EQ(failure_, std::pair(ExitCode::kInputMissing, EISDIR));
}

TEST_F(FileReader, ShowsTheBeginningOfWhatMayHaveNoEnd) {
  constexpr std::size_t kMost = 1 << 24;
  std::size_t shown = 0;
  const auto refuse = [&](std::string_view beginning) {
    shown += beginning.size();
    if (beginning[0] == '\0') throw Error(ExitCode::kBadData, "zeros");
  };
  EXPECT_THROW(ReadFile("/dev/zero", fail_, kMost, refuse), Error);
  EXPECT_GT(shown, 0u);
  EXPECT_LT(shown, std::size_t{1} << 20);
  std::ofstream(folder_ / "a") << "text";
  shown = 0;
  EXPECT_EQ(ReadFile(folder_ / "a", fail_, kMost, refuse), "text");
  EXPECT_EQ(shown, 4u);
}

TEST_F(FileReader, ReadsAPipeToItsEndAndTellsOfAReadThatFails) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], "bytes", 5), 5);
  close(ends[1]);
  EXPECT_EQ(internal::ReadDescriptor(ends[0], fail_), "bytes");
  close(ends[0]);
  EXPECT_FALSE(failure_);
  EXPECT_EQ(internal::ReadDescriptor(ends[0], fail_), "");
  EXPECT_EQ(failure_, std::pair(ExitCode::kIo, EBADF));
}

}  // namespace
}  // namespace alidade
