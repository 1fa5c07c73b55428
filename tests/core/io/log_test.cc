// SPDX-License-Identifier: Apache-2.0
#include "alidade/io/log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace alidade {
namespace {

using Messages = std::vector<std::string>;

LogSink Into(Messages& messages) {
  return [&messages](LogLevel level, std::string_view text) {
    messages.push_back(std::string(ToString(level)) + ": " + std::string(text));
  };
}

TEST(LogLevel, HasANameThatReadsBack) {
  for (const char* name : {"trace", "debug", "info", "warning", "error", "off"}) {
    ASSERT_TRUE(LogLevelOf(name).has_value()) << name;
    EXPECT_STREQ(ToString(*LogLevelOf(name)), name);
  }
  EXPECT_FALSE(LogLevelOf("Info").has_value());
  EXPECT_FALSE(LogLevelOf("").has_value());
}

TEST(Log, IsSilentWithoutASink) {
  for (const LogLevel level : {LogLevel::kTrace, LogLevel::kError, LogLevel::kOff}) {
    EXPECT_FALSE(IsLogged(level));
  }
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Log(LogLevel::kError, "nobody hears");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Log, GivesEachSinkItsLevelAndAbove) {
  Messages most, few;
  {
    const LogSubscription first(LogLevel::kDebug, Into(most)),
        second(LogLevel::kWarning, Into(few));
    EXPECT_TRUE(IsLogged(LogLevel::kDebug));
    EXPECT_FALSE(IsLogged(LogLevel::kTrace));
    Log(LogLevel::kTrace, "t");
    Log(LogLevel::kDebug, "{d}");  // the text is printed as it is, not used as a format
    Log(LogLevel::kInfo, "i");
    Log(LogLevel::kWarning, "w");
    Log(LogLevel::kError, "e");
    Log(LogLevel::kOff, "o");
  }
  Log(LogLevel::kError, "after");
  EXPECT_EQ(most, (Messages{"debug: {d}", "info: i", "warning: w", "error: e"}));
  EXPECT_EQ(few, (Messages{"warning: w", "error: e"}));
  EXPECT_FALSE(IsLogged(LogLevel::kError));
}

TEST(Log, ASinkOfLevelOffIsGivenNothing) {
  Messages messages;
  const LogSubscription sink(LogLevel::kOff, Into(messages));
  EXPECT_FALSE(IsLogged(LogLevel::kError));
  Log(LogLevel::kError, "e");
  EXPECT_TRUE(messages.empty());
}

TEST(Log, ASinkThatThrowsIsGivenNothingMoreAndTheOthersAll) {
  int calls = 0;
  Messages messages;
  const LogSubscription bad(LogLevel::kInfo, [&](LogLevel, std::string_view) {
    ++calls;
    throw std::runtime_error("disk full");
  });
  const LogSubscription good(LogLevel::kInfo, Into(messages));
  ::testing::internal::CaptureStderr();
  Log(LogLevel::kInfo, "a");
  Log(LogLevel::kInfo, "b");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(messages, (Messages{"info: a", "info: b"}));
}

TEST(Log, DropsWhatASinkLogs) {
  int calls = 0;
  const LogSubscription sink(LogLevel::kInfo, [&](LogLevel, std::string_view) {
    ++calls;
    Log(LogLevel::kInfo, "again");
  });
  Log(LogLevel::kInfo, "once");
  EXPECT_EQ(calls, 1);
}

TEST(LogScope, NamesOneRunOfManyAndLimitsItsLevel) {
  Messages messages;
  const LogSubscription sink(LogLevel::kInfo, Into(messages));
  {
    const LogScope scope("seed 7: ", LogLevel::kInfo);
    Log(LogLevel::kWarning, "diverged");
    Log(LogLevel::kDebug, "below");
    std::thread([] { Log(LogLevel::kWarning, "elsewhere"); }).join();
    const LogScope inner("seed 8: ", LogLevel::kError);
    Log(LogLevel::kWarning, "inner");
  }
  Log(LogLevel::kWarning, "after");
  EXPECT_EQ(messages, (Messages{"info: seed 7: diverged", "warning: elsewhere",
                                "warning: seed 8: inner", "warning: after"}));
}

// Four threads log 500 messages each. Another thread adds and removes sinks at the same time.
TEST(Log, TakesMessagesFromSeveralThreads) {
  Messages messages;
  const LogSubscription sink(LogLevel::kInfo, Into(messages));
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([t] {
      for (int i = 0; i < 500; ++i) Log(LogLevel::kInfo, std::to_string(t));
    });
  }
  threads.emplace_back([] {
    for (int i = 0; i < 100; ++i) {
      const LogSubscription other(LogLevel::kTrace, [](LogLevel, std::string_view) {});
    }
  });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(messages.size(), 2000u);
  EXPECT_EQ(std::count(messages.begin(), messages.end(), "info: 3"), 500);
}

}  // namespace
}  // namespace alidade
