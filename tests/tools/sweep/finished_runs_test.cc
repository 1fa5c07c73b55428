// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/finished_runs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "alidade/sweep/run_record.h"
#include "support/temporary_folder.h"

namespace alidade::internal {
namespace {

SweepRun MakeRun(std::uint64_t seed) {
  SweepRun run;
  run.seed = seed;
  run.code = ExitCode::kDiverged;
  run.reason = "estimator 'a' \"diverged\"\n";
  run.withheld = true;
  EstimatorResult one;
  one.name = "a";
  one.diverged = one.failed = true;
  one.verdict.state = VerdictState::kDiverged;
  one.units = {{"depth", "m"}};
  one.counts = {{"accepted:stereo", 75}};
  one.metrics = {{"third", 1.0 / 3.0},
                 {"least", 5e-324},
                 {"zero", -0.0},
                 {"nan", std::numeric_limits<double>::quiet_NaN()},
                 {"inf", -std::numeric_limits<double>::infinity()}};
  run.estimators.emplace_back(one);
  run.reprojection = {{"a", "pixels", "px", {1.0 / 3.0, std::nan(""), 0.5}},
                      {"a", "pairs", "", {}}};
  return run;
}

TEST(FinishedRuns, AreReadAsTheyWereWritten) {
  const testing::TemporaryFolder temporary;
  {
    OutputFolder first(temporary / "out", false);
    FinishedRuns runs(first);
    runs.Add("x=1", MakeRun(std::numeric_limits<std::uint64_t>::max()));
  }
  ASSERT_TRUE(std::filesystem::exists(temporary / "out.partial"))
      << "the partial folder must be kept";
  OutputFolder second(temporary / "out", false, true);
  const FinishedRuns runs(second);
  EXPECT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs.Find("x=1", 2), nullptr);
  EXPECT_EQ(runs.Find("", std::numeric_limits<std::uint64_t>::max()), nullptr);
  const SweepRun* const known = runs.Find("x=1", std::numeric_limits<std::uint64_t>::max());
  ASSERT_NE(known, nullptr);
  const SweepRun expected = MakeRun(std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(known->code, expected.code);
  EXPECT_EQ(known->reason, expected.reason);
  EXPECT_EQ(known->withheld, expected.withheld);
  EXPECT_EQ(RunLine("x=1", *known), RunLine("x=1", expected));
  ASSERT_EQ(known->reprojection.size(), 2u);
  EXPECT_EQ(known->reprojection[0].rms[0], 1.0 / 3.0);
  EXPECT_TRUE(std::isnan(known->reprojection[0].rms[1]));
  ASSERT_EQ(known->estimators.size(), 1u);
  const SweepRow &one = known->estimators[0], &was = expected.estimators[0];
  EXPECT_EQ(one.name, was.name);
  EXPECT_TRUE(one.diverged && one.failed && one.verdict == VerdictState::kDiverged);
  EXPECT_EQ(one.units.names(), was.units.names());
  EXPECT_EQ(one.units.values(), was.units.values());
  EXPECT_EQ(one.counts.names(), was.counts.names());
  EXPECT_EQ(one.counts.values(), was.counts.values());
  ASSERT_EQ(one.metrics.names(), was.metrics.names());
  for (const std::string& key : was.metrics.names()) {
    const double value = *was.metrics.Find(key);
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(*one.metrics.Find(key)));
    } else {
      EXPECT_EQ(*one.metrics.Find(key), value) << key;
      EXPECT_EQ(std::signbit(*one.metrics.Find(key)), std::signbit(value)) << key;
    }
  }
  EXPECT_EQ(RunLine("x=1", *known), RunLine("x=1", expected));
}

TEST(FinishedRuns, OfSeveralThreadsAreAllWritten) {
  const testing::TemporaryFolder temporary;
  OutputFolder folder(temporary / "out", false);
  FinishedRuns runs(folder);
  constexpr std::uint64_t kThreads = 4, kRuns = 500;
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t i = 0; i < kThreads; ++i) {
      threads.emplace_back([&runs, i] {
        for (std::uint64_t k = 0; k < kRuns; ++k) runs.Add("", MakeRun(i * kRuns + k));
      });
    }
  }
  std::set<std::uint64_t> seeds;
  std::ifstream stream(folder.partial() / kFinishedRuns);
  for (std::string line; std::getline(stream, line);) {
    const std::optional<ParsedRunLine> read = ReadRunLine(line);
    ASSERT_TRUE(read) << line;
    EXPECT_TRUE(seeds.insert(read->run.seed).second)
        << "this seed occurs twice: " << read->run.seed;
  }
  EXPECT_EQ(seeds.size(), kThreads * kRuns);
}

TEST(RunLine, OfARunThatFailedSaysSo) {
  SweepRun failed = MakeRun(2);
  failed.status = RunStatus::kFailed;
  const std::string line = RunLine("", failed);
  const std::optional<ParsedRunLine> read = ReadRunLine(line);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->run.status, RunStatus::kFailed);
  EXPECT_EQ(RunLine(read->value, read->run), line);
  EXPECT_FALSE(ReadRunLine(line.substr(0, 40)));
}

TEST(FinishedRuns, ALineThatWasCutIsRemovedAndAnyOtherIsRefused) {
  const testing::TemporaryFolder temporary;
  const std::string line = RunLine("", MakeRun(1)), next = RunLine("", MakeRun(2));
  OutputFolder folder(temporary / "out", false);
  folder.Write(kFinishedRuns, line + line.substr(0, 40));
  {
    FinishedRuns runs(folder);
    EXPECT_EQ(runs.size(), 1u);
    runs.Add("", MakeRun(2));
  }
  std::ifstream stream(folder.partial() / kFinishedRuns);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(text, line + next);
  folder.Write(kFinishedRuns, line + "{\"seed\": \"one\"}\n");
  try {
    const FinishedRuns runs(folder);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kBadData);
    EXPECT_TRUE(
        std::string(error.what()).starts_with((folder.partial() / kFinishedRuns).string() + ":2: "))
        << error.what();
  }
}

}  // namespace
}  // namespace alidade::internal
