// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/log_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>
#include <vector>

#include "support/temporary_folder.h"

namespace alidade::internal {
namespace {

std::string LogOf(const std::filesystem::path& folder) {
  std::ifstream stream(folder / "log.txt");
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Collects the warnings that are logged during the lifetime of this object.
struct Warnings {
  std::vector<std::string> texts;
  LogSubscription sink{LogLevel::kWarning,
                       [this](LogLevel, std::string_view text) { texts.emplace_back(text); }};
};

TEST(LogFile, HoldsTheMessagesOfItsThreadFromInfoOn) {
  const testing::TemporaryFolder temporary;
  OutputFolder folder(temporary / "out", false);
  LogFile file(folder);
  Log(LogLevel::kDebug, "left out");
  Log(LogLevel::kInfo, "a");
  std::thread([] { Log(LogLevel::kWarning, "another run"); }).join();
  Log(LogLevel::kWarning, "b");
  file.Close();
  Log(LogLevel::kWarning, "after");
  folder.Commit();
  EXPECT_EQ(LogOf(temporary / "out"), "info: a\nwarning: b\n");
}

TEST(LogFile, ThatCannotBeCreatedIsAWarning) {
  const testing::TemporaryFolder temporary;
  OutputFolder folder(temporary / "out", false);
  std::filesystem::create_directory(folder.partial() / "log.txt");
  const Warnings warnings;
  LogFile file(folder);
  Log(LogLevel::kInfo, "a");
  file.Close();
  ASSERT_EQ(warnings.texts.size(), 1u);
  EXPECT_TRUE(warnings.texts[0].starts_with((temporary / "out.partial/log.txt").string() +
                                            ": cannot create: "))
      << warnings.texts[0];
  EXPECT_TRUE(warnings.texts[0].ends_with("; the run continues without a log"));
}

// A file size limit of 4 bytes replaces a full disk. The buffer has 64 KiB: a single message is
// written only at the end, but a thousand messages of 100 bytes exceed the buffer.
TEST(LogFile, ThatCannotBeWrittenIsAWarning) {
  for (const int messages : {1, 1000}) {
    const testing::TemporaryFolder temporary;
    OutputFolder folder(temporary / "out", false);
    const Warnings warnings;
    LogFile file(folder);
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlimit little{4, before.rlim_max};
    ::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
    for (int i = 0; i < messages; ++i) Log(LogLevel::kInfo, std::string(100, 'x'));
    file.Close();
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    ASSERT_EQ(warnings.texts.size(), 1u) << messages;
    EXPECT_TRUE(warnings.texts[0].find("out.partial/log.txt: cannot write: ") != std::string::npos)
        << warnings.texts[0];
    folder.Write("run.json", "{}");
    folder.Commit();
    EXPECT_TRUE(std::filesystem::exists(temporary / "out/run.json"));
  }
}

}  // namespace
}  // namespace alidade::internal
