// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/config.h"
#include "support/run_files.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;

/// Tests with a source that draws truth and measurements from the models of the config.
class VaryFilterCli : public testing::ProgramTest {
 protected:
  static constexpr const char* kNoise = "state.target.noise.acceleration";

  Outcome Sweep(const std::string& folder, const Arguments& more) const {
    Arguments arguments = {
        "sweep",  ALIDADE_SOURCE_DIR "/examples/19_outliers_from_models/config.yaml",
        "--runs", "8",
        "--set",  "source.sensors={}",
        "-o",     folder};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Call(arguments);
  }
  /// Returns the mean NEES of the estimator `all` for each value.
  std::vector<double> Nees(const std::string& folder) const {
    std::vector<double> nees;
    const Config summary = Json(folder + "/sweep.json");
    for (const Node& value : summary.root().At("values").Items()) {
      const Node metrics = value.At("estimators").At("all").At("metrics");
      nees.push_back(metrics.At("nees.mean:target").At("mean").Number());
    }
    return nees;
  }
};

// The noise of the truth is 0.05. With 0.005 and 0.5 the filter is wrong, and NEES shows this only
// if the truth keeps its noise.
TEST_F(VaryFilterCli, ChangesTheEstimatorsOnly) {
  const std::string values = std::string(kNoise) + "=0.005,0.05,0.5";
  const Outcome filter = Sweep("filter", {"--vary-filter", values});
  ASSERT_EQ(filter.code, 0) << filter.err;
  EXPECT_FALSE(Contains(filter.err, "warning")) << filter.err;
  const std::vector<double> nees = Nees("filter");
  ASSERT_EQ(nees.size(), 3u);
  EXPECT_GT(nees[0], 2.0 * nees[1]);
  EXPECT_LT(nees[2], 0.8 * nees[1]);
  EXPECT_EQ(Json("filter/sweep.json").root().At("scope").Text(), "estimators");
  EXPECT_TRUE(Contains(Read("filter/table.md"), "for each value, for the estimators only"));
  // Each table has the counts of the verdicts that occurred.
  EXPECT_TRUE(Contains(filter.out, "  lost  overconfident  consistent  ")) << filter.out;
  EXPECT_TRUE(Contains(testing::Unwrapped(filter.out), " 0.05 8 0 0 8 "));
  EXPECT_TRUE(
      Contains(Read("filter/table.md"), "| runs used | lost | overconfident | consistent |"))
      << Read("filter/table.md");

  // The value of the config gives the same results as a sweep without a varied key.
  ASSERT_EQ(Sweep("plain", {}).code, 0);
  const Config plain = Json("plain/sweep.json");
  const Node metrics = plain.root().At("estimators").At("all").At("metrics");
  EXPECT_EQ(nees[1], metrics.At("nees.mean:target").At("mean").Number());
}

TEST_F(VaryFilterCli, AVariedKeyThatTheSourceReadsCausesAWarning) {
  const std::string values = std::string(kNoise) + "=0.005,0.5";
  const std::string warning = std::string("--vary ") + kNoise + ": the source also reads this key";
  const Outcome both = Sweep("both", {"--vary", values});
  ASSERT_EQ(both.code, 0) << both.err;
  EXPECT_TRUE(Contains(both.err, "warning: " + warning)) << both.err;
  EXPECT_TRUE(Contains(both.err, "use --vary-filter")) << both.err;
  EXPECT_TRUE(Contains(Read("both/table.md"), "\nWarning: " + warning)) << Read("both/table.md");

  const Outcome pinned = Sweep(
      "pinned", {"--vary", values, "--set", "source.overrides." + std::string(kNoise) + "=0.05"});
  ASSERT_EQ(pinned.code, 0) << pinned.err;
  EXPECT_FALSE(Contains(pinned.err, warning)) << pinned.err;
  EXPECT_FALSE(Contains(Read("pinned/table.md"), "Warning"));
  EXPECT_GT(Nees("pinned")[0], 2.0 * Nees("both")[0]);
}

// The first value changes the data, but the key belongs to the source.
TEST_F(VaryFilterCli, AVariedKeyOfTheSourceCausesNoWarning) {
  const Outcome source = Sweep("out", {"--vary", "source.rate_hz=10,20"});
  ASSERT_EQ(source.code, 0) << source.err;
  EXPECT_FALSE(Contains(source.err, "warning")) << source.err;
}

TEST_F(VaryFilterCli, RefusesKeysThatAnEstimatorCannotOverride) {
  const Outcome source = Sweep("out", {"--vary-filter", "source.rate_hz=10,20"});
  EXPECT_EQ(source.code, 78);
  EXPECT_TRUE(Contains(source.err, "an estimator cannot override 'source'")) << source.err;
  const Outcome two = Sweep("out", {"--vary-filter", "a=1,2", "--vary", "b=1,2"});
  EXPECT_EQ(two.code, 2);
  EXPECT_EQ(two.err, "error: --vary excludes --vary-filter\nsee `alidade sweep --help`\n");
}

TEST_F(VaryFilterCli, MergedShardsEqualTheWholeSweep) {
  for (const std::string option : {"--vary", "--vary-filter"}) {
    const Arguments vary = {option, std::string(kNoise) + "=0.005,0.5"};
    const std::string whole = "whole" + option;
    ASSERT_EQ(Sweep(whole, vary).code, 0);
    Arguments merge = {"merge", "-o", "merged" + option};
    for (const std::string shard : {"1/2", "2/2"}) {
      const std::string folder = option + shard.substr(0, 1);
      Arguments arguments = vary;
      arguments.insert(arguments.end(), {"--shard", shard});
      ASSERT_EQ(Sweep("s" + folder, arguments).code, 0);
      merge.push_back("s" + folder);
    }
    const Outcome merged = Call(merge);
    ASSERT_EQ(merged.code, 0) << merged.err;
    testing::ExpectSameFiles(folder_ / ("merged" + option), folder_ / whole);
  }
}

// The command below the table repeats a run with the same results.
TEST_F(VaryFilterCli, ASweepNamesItsWorstSeedsAndHowToRepeatThem) {
  const Outcome sweep = Sweep("sweep", {});
  ASSERT_EQ(sweep.code, 0) << sweep.err;
  EXPECT_TRUE(Contains(sweep.out, "\nworst seeds of all by ")) << sweep.out;
  EXPECT_TRUE(Contains(Read("sweep/table.md"), "\nworst seeds of huber by "));
  const std::string start =
      "\nrepeat the run of a seed: alidade run sweep/config.resolved.yaml --seed ";
  const std::size_t found = sweep.out.find(start);
  ASSERT_NE(found, std::string::npos) << sweep.out;
  const std::string seed = sweep.out.substr(found + start.size(),
                                            sweep.out.find('\n', found + 1) - found - start.size());
  const Outcome run = Call({"run", "sweep/config.resolved.yaml", "--seed", seed, "-o", "run"});
  ASSERT_EQ(run.code, 0) << run.err;
  const Config record = Json("run/run.json");
  const double nees =
      record.root().At("estimators").At("all").At("metrics").At("nees.mean:target").Number();
  const Config summary = Json("sweep/sweep.json");
  const Node metrics = summary.root().At("estimators").At("all").At("metrics");
  EXPECT_GT(nees, metrics.At("nees.mean:target").At("p95").Number());
}

}  // namespace
}  // namespace alidade
