// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <algorithm>

#include "alidade/config/config.h"
#include "support/run_files.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;
using SweepCli = testing::ProgramTest;

std::string Rows(const std::string& csv) { return csv.substr(csv.find('\n') + 1); }

// Tests fault 97 of tests/faults/README.md.
TEST_F(SweepCli, GivesTheSameBytesForAnyNumberOfJobs) {
  for (const std::string jobs : {"1", "2", "3"}) {
    const Outcome sweep =
        Call({"sweep", "config.yaml", "--runs", "12", "--jobs", jobs, "-o", "jobs" + jobs});
    EXPECT_EQ(sweep.code, 0) << sweep.err;
    testing::ExpectSameFiles(folder_ / ("jobs" + jobs), folder_ / "jobs1");
  }
}

// Only run times differ: one entry of compare.json and one row of each table.
TEST_F(SweepCli, AComparisonOverSeedsHasTheSameBytesForAnyNumberOfJobs) {
  const auto files = [&](const std::string& jobs) {
    const Outcome comparison = Call({"compare", "config.yaml", "--runs", "4", "--no-decomposition",
                                     "--jobs", jobs, "-o", "jobs" + jobs});
    EXPECT_EQ(comparison.code, 0) << comparison.err;
    auto all = testing::RunFiles(folder_ / ("jobs" + jobs));
    // Removes the times from the files.
    std::string& json = all["compare.json"];
    for (const char* key : {"\"cpu_us\"", "\"time_us\""}) {
      const std::size_t clock = json.find(key);
      json.erase(clock, json.find('}', clock) - clock);
    }
    for (const char* table : {"compare.md", "compare.tex"}) {
      std::string& text = all[table];
      const std::size_t row = text.find("CPU time [us/frame]");
      text.erase(row, text.find('\n', row) - row);
    }
    for (const char* file : {"cost.csv", "report.html"}) all.erase(file);
    return all;
  };
  const auto one = files("1");
  EXPECT_EQ(files("2"), one);
  EXPECT_EQ(files("3"), one);
}

TEST_F(SweepCli, SummarisesRunsThatRunWouldGive) {
  const Outcome sweep =
      Call({"sweep", "config.yaml", "--runs", "1", "--first-seed", "7", "-o", "sweep"});
  EXPECT_EQ(sweep.code, 0) << sweep.err;
  EXPECT_TRUE(Contains(sweep.out, "rmse target.depth [mm]")) << sweep.out;
  EXPECT_TRUE(Contains(sweep.out, "inside 95 % region target.depth [%]")) << sweep.out;
  EXPECT_EQ(Call({"run", "config.yaml", "--seed", "7", "-o", "run"}).code, 0);
  const Config summary = Json("sweep/sweep.json"), record = Json("run/run.json");
  EXPECT_EQ(summary.root().At("runs").Number(), 1);
  EXPECT_EQ(summary.root().At("runs_used").Number(), 1);
  EXPECT_EQ(summary.root().At("first_seed").Number(), 7);
  const Node ekf = summary.root().At("estimators").At("ekf");
  EXPECT_EQ(ekf.At("verdicts").At("diverged").Number(), 0);
  const Node metrics = record.root().At("estimators").At("ekf").At("metrics");
  const double rmse = metrics.At("rmse:target.depth").Number();
  for (const char* key : {"mean", "p05", "p50", "p95"}) {
    EXPECT_EQ(ekf.At("metrics").At("rmse:target.depth").At(key).Number(), rmse) << key;
  }
}

TEST_F(SweepCli, SharesMakeTheWhole) {
  // Without a gate all shards have the same outcomes, so their tables have the same columns.
  const auto rows = [&](const std::string& folder, const std::string& shard) {
    const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "5", "-o", folder, "--shard",
                                shard, "--set", "estimators.ekf.gate=none"});
    EXPECT_EQ(sweep.code, 0) << sweep.err;
    return Rows(Read(folder + "/runs.csv"));
  };
  EXPECT_EQ(rows("a", "1/2") + rows("b", "2/2"), rows("whole", "1/1"));
  EXPECT_EQ(Json("b/sweep.json").root().At("first_seed").Number(), 3);
}

TEST_F(SweepCli, RefusesWhatIsNoShare) {
  // In 32 bits 4294967297 would become 1.
  for (const std::string shard :
       {"4294967297/4294967297", "1/99999999999999999999", "01/1", "1/01", "1/", "/2", "1", "",
        "0/2", "3/2", "1/2/3", "1/2x", " 1/2", "-1/2"}) {
    const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "1", "--shard=" + shard});
    EXPECT_EQ(sweep.code, 2) << shard;
  }
  const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "1", "--shard", "3/2"});
  EXPECT_TRUE(Contains(sweep.err, "--shard: '3/2' is not a shard")) << sweep.err;
}

TEST_F(SweepCli, EveryShareHasARun) {
  const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "2", "--shard", "1/3"});
  EXPECT_EQ(sweep.code, 2);
  EXPECT_TRUE(
      Contains(sweep.err, "error: --shard: 3 shards of 2 runs; expected at least one run for each"))
      << sweep.err;
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs", "2", "--shard", "2/2"}).code, 0);
}

TEST_F(SweepCli, RefusesASourceThatCanBeReadOnce) {
  ASSERT_EQ(::mkfifo((folder_ / "table.csv").c_str(), 0600), 0);
  const Outcome pipe = Call({"sweep", "table.yaml", "--runs", "2", "-o", "out"});
  EXPECT_EQ(pipe.code, 78);
  EXPECT_TRUE(pipe.err.starts_with("error: table.yaml:11:30 source.path: '")) << pipe.err;
  EXPECT_TRUE(Contains(pipe.err, "can be read only once")) << pipe.err;
  for (const char* once : {"-", "/dev/stdin"}) {
    const Outcome sweep = Call({"sweep", "table.yaml", "--runs", "2", "--set",
                                std::string("source.path=") + once, "-o", "out"});
    EXPECT_EQ(sweep.code, 78) << sweep.err;
    EXPECT_TRUE(sweep.err.starts_with("error: --set source.path: '")) << sweep.err;
    // With --vary the path is refused as well, before the source is read.
    const Outcome varied =
        Call({"sweep", "table.yaml", "--runs", "2", "--vary", "sensors.stereo.sigma_px=1,2",
              "--set", std::string("source.path=") + once, "-o", "out"});
    EXPECT_EQ(varied.code, 78) << varied.err;
    EXPECT_TRUE(Contains(varied.err, "can be read only once")) << varied.err;
  }
  EXPECT_FALSE(Exists("out"));
  // If the source does not have the key, the message is still `unknown key`.
  const Outcome unknown = Call({"sweep", "config.yaml", "--runs", "2", "--set", "source.path=a"});
  EXPECT_EQ(unknown.code, 78);
  EXPECT_TRUE(Contains(unknown.err, "source.path: unknown key")) << unknown.err;
}

TEST_F(SweepCli, GoesOnWithTheThreadsThereAre) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_STACK, &before), 0);
  // The stack of each thread takes half of the address space, so not all threads can be started.
  const rlimit huge{std::min<rlim_t>(rlim_t{1} << 46, before.rlim_max), before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_STACK, &huge), 0);
  const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "6", "--jobs", "6", "-o", "out"});
  ASSERT_EQ(::setrlimit(RLIMIT_STACK, &before), 0);
  EXPECT_EQ(sweep.code, 0) << sweep.err;
  EXPECT_EQ(Json("out/sweep.json").root().At("runs_used").Number(), 6);
}

TEST_F(SweepCli, CountsDivergedRunsAndLeavesTheirMetricsOut) {
  const Outcome sweep = Call(Diverging({"sweep", "config.yaml", "--runs", "3", "-o", "out", "--set",
                                        "estimators.ekf.on_divergence=fail"}));
  EXPECT_EQ(sweep.code, 0) << sweep.err;
  const Config summary = Json("out/sweep.json");
  const Node ekf = summary.root().At("estimators").At("ekf");
  EXPECT_EQ(ekf.At("verdicts").At("diverged").Number(), 3);
  EXPECT_TRUE(ekf.At("metrics").Entries().empty());
  EXPECT_TRUE(Contains(Read("out/runs.csv"), "\n2,ekf,diverged,"));
}

// The sigma of the filter is a hundredth of the true noise.
TEST_F(SweepCli, InconsistentRunsCountAndAreTold) {
  const Arguments too_sure = {"--set", "sensors.stereo.sigma_px=0.01",
                              "--set", "sensors.scale.sigma_px=0.01",
                              "--set", "estimators.ekf.gate=none"};
  Arguments arguments = {"sweep", "config.yaml", "--runs", "1", "--first-seed", "7", "-o", "out"};
  arguments.insert(arguments.end(), too_sure.begin(), too_sure.end());
  const Outcome sweep = Call(arguments);
  ASSERT_EQ(sweep.code, 0) << sweep.err;
  arguments = {"run", "config.yaml", "--seed", "7", "-o", "run"};
  arguments.insert(arguments.end(), too_sure.begin(), too_sure.end());
  ASSERT_EQ(Call(arguments).code, 0);
  const Config summary = Json("out/sweep.json"), record = Json("run/run.json");
  const Node ekf = summary.root().At("estimators").At("ekf");
  EXPECT_EQ(ekf.At("verdicts").At("diverged").Number(), 0);
  EXPECT_EQ(ekf.At("verdicts").At("lost").Number(), 1);
  const Node metrics = record.root().At("estimators").At("ekf").At("metrics");
  for (const char* key : {"rmse:target.depth", "nees.mean:target"}) {
    EXPECT_EQ(ekf.At("metrics").At(key).At("mean").Number(), metrics.At(key).Number()) << key;
  }
  EXPECT_TRUE(Contains(Read("out/runs.csv"), "\n7,ekf,lost,"));
  EXPECT_TRUE(Contains(Read("out/table.md"), "| runs used | 1 |")) << Read("out/table.md");
}

TEST_F(SweepCli, ReportsFailedRunsWithTheirSeeds) {
  Write("table.csv", "t_s,d\n0,80\n0.1,none\n");
  const Outcome sweep = Call({"sweep", "table.yaml", "--runs", "2", "-o", "out"});
  EXPECT_EQ(sweep.code, 1);
  EXPECT_TRUE(Contains(sweep.err, "error: seed 2: ")) << sweep.err;
  EXPECT_TRUE(Contains(sweep.err, "table.csv:3:5")) << sweep.err;
  EXPECT_TRUE(Contains(Read("out/failures.csv"), "\n2,65,")) << Read("out/failures.csv");
  EXPECT_EQ(Json("out/sweep.json").root().At("runs_used").Number(), 0);
}

TEST_F(SweepCli, ReplacesItsFolderOnlyByForce) {
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs", "1"}).code, 0);
  EXPECT_TRUE(Exists("runs/sweep-config/sweep.json"));
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs", "1"}).code, 0);
  EXPECT_TRUE(Exists("runs/sweep-config-2/sweep.json"));
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs", "1", "-o", "runs/sweep-config"}).code, 73);
  EXPECT_EQ(Call({"sweep", "config.yaml", "--runs", "1", "--force"}).code, 0);
}

TEST_F(SweepCli, EachValueOfAKeyIsSweptAsIfItWereSet) {
  // Without a gate all values have the same outcomes, so their tables have the same columns.
  const std::string no_gate = "estimators.ekf.gate=none";
  const Outcome varied =
      Call({"sweep", "config.yaml", "--runs", "3", "--first-seed", "5", "-o", "varied", "--vary",
            "sensors.stereo.sigma_px=0.5,2", "--set", no_gate});
  ASSERT_EQ(varied.code, 0) << varied.err;
  EXPECT_TRUE(Contains(varied.out, "ekf, means by sensors.stereo.sigma_px\n")) << varied.out;
  EXPECT_TRUE(Contains(testing::Unwrapped(varied.out), " 0.5 3 ")) << varied.out;
  const Config summary = Json("varied/sweep.json");
  EXPECT_EQ(summary.root().At("vary").Text(), "sensors.stereo.sigma_px");
  EXPECT_EQ(summary.root().At("status").Text(), "ok");
  const std::vector<Node> values = summary.root().At("values").Items();
  ASSERT_EQ(values.size(), 2u);
  std::string rows;
  for (std::size_t v = 0; v < 2; ++v) {
    const std::string value = v == 0 ? "0.5" : "2", folder = "set-" + value;
    const Outcome set =
        Call({"sweep", "config.yaml", "--runs", "3", "--first-seed", "5", "-o", folder, "--set",
              "sensors.stereo.sigma_px=" + value, "--set", no_gate});
    ASSERT_EQ(set.code, 0) << set.err;
    EXPECT_EQ(values[v].At("value").Text(), value);
    EXPECT_EQ(values[v].At("runs_used").Number(), 3);
    const auto rmse = [](const Node& of) {
      const Node metrics = of.At("estimators").At("ekf").At("metrics");
      return metrics.At("rmse:target.depth").At("mean").Number();
    };
    EXPECT_EQ(rmse(values[v]), rmse(Json(folder + "/sweep.json").root()));
    std::istringstream lines(Rows(Read(folder + "/runs.csv")));
    for (std::string line; std::getline(lines, line);) rows += value + ',' + line + '\n';
  }
  EXPECT_EQ(Rows(Read("varied/runs.csv")), rows);
  const std::string table = Read("varied/sweep.csv");
  EXPECT_TRUE(
      table.starts_with("sensors.stereo.sigma_px,ekf.used,ekf.diverged,ekf.lost,"
                        "ekf.mean:rmse:"));
  EXPECT_TRUE(Contains(table, "\n0.5,3,0,0,")) << table;
  EXPECT_TRUE(Contains(table, "\n2,3,0,0,")) << table;
}

TEST_F(SweepCli, ValuesMayBeMaps) {
  const Outcome varied =
      Call({"sweep", "config.yaml", "--runs", "2", "-o", "out", "--vary",
            "estimators.ekf.rejection_recovery={after: 5, action: none},{after: 6}"});
  ASSERT_EQ(varied.code, 0) << varied.err;
  EXPECT_EQ(Json("out/sweep.json").root().At("values").Items().size(), 2u);
  const std::string page = Read("out/report.html");
  EXPECT_TRUE(Contains(page, "\"value\":\"{after: 5, action: none}\",\"label\":"));
  EXPECT_TRUE(varied.out.ends_with("\nreport   out/report.html\n")) << varied.out;
}

TEST_F(SweepCli, TheErrorOfTheMapIsInTablesAndPage) {
  const Outcome varied =
      Call({"sweep", ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml", "--runs", "1", "-o",
            "out", "--vary", "sensors.pixels.sigma_px=1,2"});
  ASSERT_EQ(varied.code, 0) << varied.err;
  EXPECT_TRUE(Contains(testing::Unwrapped(varied.out), " map.rmse ")) << varied.out;
  EXPECT_TRUE(Contains(Read("out/sweep.csv"), "ekf.mean:map.rmse"));
  EXPECT_TRUE(Contains(Read("out/report.html"), "\"map.rmse\":\"zero\""));
}

TEST_F(SweepCli, SeveralKeysTakeEachValueAndTheReprojectionErrorOfEachIsACurve) {
  const std::string config = ALIDADE_SOURCE_DIR "/examples/11_slam_reprojection/config.yaml";
  const std::string keys = "source.sigma_px+sensors.pixels.sigma_px";
  const Outcome varied = Call({"sweep", config, "--runs", "1", "--first-seed", "3", "-o", "out",
                               "--set", "source.max_frames=20", "--vary", keys + "=0.5,2"});
  ASSERT_EQ(varied.code, 0) << varied.err;
  std::string rows = keys + ",estimator,sensor,unit,frame,runs,rms\n";
  for (const std::string value : {"0.5", "2"}) {
    const Outcome run =
        Call({"run", config, "--seed", "3", "-o", "run" + value, "--set", "source.max_frames=20",
              "--set", "source.sigma_px=" + value, "--set", "sensors.pixels.sigma_px=" + value});
    ASSERT_EQ(run.code, 0) << run.err;
    std::istringstream lines(Rows(Read("run" + value + "/ekf/reprojection.csv")));
    int frame = 0;
    for (std::string line; std::getline(lines, line);) {
      if (!Contains(line, ",pixels,")) continue;
      // In the first frame no landmark has been initialised, so there is no innovation.
      if (frame == 0) rows += value + ",ekf,pixels,px,1,0,\n", frame = 1;
      rows += value + ",ekf,pixels,px," + std::to_string(++frame) + ",1," +
              line.substr(line.rfind(',') + 1) + '\n';
    }
  }
  std::string found;
  std::istringstream lines(Read("out/reprojection.csv"));
  for (std::string line; std::getline(lines, line);) {
    if (!Contains(line, ",known,")) found += line + '\n';
  }
  EXPECT_EQ(found, rows);
  EXPECT_TRUE(Contains(Read("out/report.html"), "\"sensor\":\"pixels\",\"unit\":\"px\""));
}

TEST_F(SweepCli, AKeyIsNotGivenTwice) {
  for (const std::string keys : {"source.sigma_px+source.sigma_px", "source.sigma_px+", "+a"}) {
    const Outcome varied =
        Call({"sweep", "config.yaml", "--runs", "1", "-o", "out", "--vary", keys + "=1,2"});
    EXPECT_EQ(varied.code, 2) << varied.err;
    EXPECT_TRUE(Contains(varied.err, "has an empty or repeated key")) << varied.err;
  }
}

TEST_F(SweepCli, ValuesAreReadWithoutTheBlanksAroundThem) {
  const Outcome varied = Call({"sweep", "config.yaml", "--runs", "1", "-o", "out", "--vary",
                               "estimators.ekf= {type: ekf} ,{type: ekf, gate: 0.99}"});
  ASSERT_EQ(varied.code, 0) << varied.err;
  const Config summary = Json("out/sweep.json");
  const std::vector<Node> values = summary.root().At("values").Items();
  EXPECT_EQ(values[0].At("value").Text(), "{type: ekf}");
  EXPECT_EQ(values[1].At("value").Text(), "{type: ekf, gate: 0.99}");
  const Outcome twice = Call({"sweep", "config.yaml", "--runs", "1", "-o", "twice", "--vary",
                              "sensors.stereo.sigma_px=1, 2, 1"});
  EXPECT_EQ(twice.code, 2);
  EXPECT_TRUE(Contains(twice.err, "has the value '1' twice")) << twice.err;
}

// A table has the same rows for every seed, so all runs would be equal.
TEST_F(SweepCli, RefusesSeveralRunsOverDataThatNoSeedChanges) {
  Write("table.csv", "t_s,d\n0,80\n0.1,81\n");
  const Arguments several = {"sweep", "table.yaml", "--runs", "3", "-o", "out"};
  const Outcome sweep = Call(several);
  EXPECT_EQ(sweep.code, 78);
  EXPECT_TRUE(Contains(sweep.err,
                       "source 'tables' produces the same data for every seed: all runs would be "
                       "equal; "
                       "expected one run, or a source whose data depend on the seed"))
      << sweep.err;
  Arguments varied = several;
  varied.insert(varied.end(), {"--vary", "sensors.stereo.sigma_px=1,2"});
  EXPECT_EQ(Call(varied).code, 78);
  varied[3] = "1";
  EXPECT_EQ(Call(varied).code, 0);
  const Outcome compared = Call({"compare", "table.yaml", "--runs", "3", "-o", "compared"});
  EXPECT_EQ(compared.code, 78);
  EXPECT_TRUE(Contains(compared.err, "produces the same data for every seed")) << compared.err;
}

TEST_F(SweepCli, FailuresOfAVariedSweepNameTheirValue) {
  Write("table.csv", "t_s,d\n0,80\n0.1,none\n");
  const Outcome sweep = Call(
      {"sweep", "table.yaml", "--runs", "1", "-o", "out", "--vary", "sensors.stereo.sigma_px=1,2"});
  EXPECT_EQ(sweep.code, 1);
  for (const char* value : {"1", "2"}) {
    const std::string where = std::string("error: sensors.stereo.sigma_px=") + value + ", seed 1: ";
    EXPECT_TRUE(Contains(sweep.err, where)) << sweep.err;
  }
}

TEST_F(SweepCli, EveryValueHasTheSameEstimators) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"{a: {type: ekf}, b: {type: iekf}},{a: {type: ekf}}",
       "error: --vary estimators: the estimators are a with '{a: {type: ekf}}', but a, b with '{a: "
       "{type: ekf}, b: {type: iekf}}'; expected the same estimators for every value"},
      {"{ekf: {type: ekf}},{other: {type: iekf}}", "the estimators are other with '{other: "}};
  for (const auto& [values, words] : wrong) {
    const Outcome sweep = Call(
        {"sweep", "config.yaml", "--runs", "1", "-o", "out", "--vary", "estimators=" + values});
    EXPECT_EQ(sweep.code, 78) << values << sweep.err;
    EXPECT_TRUE(Contains(sweep.err, words)) << sweep.err;
    EXPECT_FALSE(Exists("out"));
  }
  const Outcome same = Call({"sweep", "config.yaml", "--runs", "1", "-o", "out", "--vary",
                             "estimators={a: {type: ekf}, b: {type: iekf}},{a: {type: iekf}, b: "
                             "{type: ekf}}"});
  ASSERT_EQ(same.code, 0) << same.err;
  const Config summary = Json("out/sweep.json");
  const std::vector<Node> values = summary.root().At("values").Items();
  const auto rmse = [&](std::size_t value, const char* name) {
    const Node metrics = values[value].At("estimators").At(name).At("metrics");
    return metrics.At("rmse:target.depth").At("mean").Number();
  };
  EXPECT_EQ(rmse(0, "a"), rmse(1, "b"));
  EXPECT_EQ(rmse(0, "b"), rmse(1, "a"));
}

/// Adds an estimator `bad`, which diverges in every run.
const Arguments kDiverging = {
    "--set",
    "estimators.bad={type: ekf, overrides: {state: {target: {initial: {depth: {mean: -0.2, sigma: "
    "0.1}, depth_rate: {mean: 0, sigma: 0.5}}}}}}"};

// Tests fault 85 of tests/faults/README.md.
TEST_F(SweepCli, TellsHowOftenTheReferenceWasWithheld) {
  Arguments arguments = {"sweep", "config.yaml", "--runs", "2",
                         "-o",    "out",         "--set",  "reference=bad"};
  arguments.insert(arguments.end(), kDiverging.begin(), kDiverging.end());
  const Outcome sweep = Call(arguments);
  ASSERT_EQ(sweep.code, 0) << sweep.err;
  const std::string words =
      "\nerrors are differences from estimator 'bad', not from truth; coverage and NEES are "
      "not computed; "
      "the errors are withheld in 2 of 2 runs, in which the reference failed, diverged or had no "
      "estimates\n";
  EXPECT_TRUE(Contains(sweep.out, words)) << sweep.out;
  EXPECT_TRUE(Contains(Read("out/table.md"), words)) << Read("out/table.md");
  EXPECT_EQ(Json("out/sweep.json").root().At("withheld").Number(), 2);
}

TEST_F(SweepCli, AVariedReferenceIsNamedForEachValue) {
  Arguments arguments = {"sweep", "config.yaml", "--runs", "1",
                         "-o",    "out",         "--vary", "reference=truth,ekf,bad"};
  arguments.insert(arguments.end(), kDiverging.begin(), kDiverging.end());
  const Outcome sweep = Call(arguments);
  ASSERT_EQ(sweep.code, 0) << sweep.err;
  const Config summary = Json("out/sweep.json");
  const std::vector<Node> values = summary.root().At("values").Items();
  const std::string names[] = {"truth", "ekf", "bad"};
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_EQ(values[v].At("reference").Text(), names[v]);
    EXPECT_EQ(values[v].At("withheld").Number(), v == 2 ? 1 : 0);
  }
  for (const std::string& text : {sweep.out, Read("out/table.md")}) {
    EXPECT_TRUE(Contains(text, "\ntruth: errors are differences from truth\n")) << text;
    EXPECT_TRUE(Contains(text,
                         "\nekf: errors are differences from estimator 'ekf', not from "
                         "truth; coverage and NEES are not computed\n"))
        << text;
    EXPECT_TRUE(Contains(text, "; the errors are withheld in 1 of 1 runs")) << text;
  }
  // If all values have the same reference, the reference is named only once.
  arguments[7] = "sensors.stereo.sigma_px=1,2";
  arguments[5] = "one";
  arguments.insert(arguments.end(), {"--set", "reference=ekf"});
  const Outcome one = Call(arguments);
  ASSERT_EQ(one.code, 0) << one.err;
  EXPECT_TRUE(Contains(one.out, "\nerrors are differences from estimator 'ekf'")) << one.out;
}

// inputs.json lists the inputs of all values, including the files that only the source reads.
TEST_F(SweepCli, RecordsTheInputsOfEveryValue) {
  for (const char* name : {"a.csv", "b.csv"}) Write(name, "t_s,d\n0,80\n0.1,79\n");
  const Outcome data = Call(
      {"sweep", "table.yaml", "--runs", "1", "-o", "out", "--vary", "source.path=a.csv,b.csv"});
  ASSERT_EQ(data.code, 0) << data.err;
  const std::string inputs = Read("out/inputs.json");
  EXPECT_TRUE(Contains(inputs, "/a.csv\", \"bytes\"")) << inputs;
  EXPECT_TRUE(Contains(inputs, "/b.csv\", \"bytes\"")) << inputs;
  EXPECT_FALSE(Contains(inputs, "/table.csv\"")) << inputs;
  EXPECT_TRUE(Contains(inputs, "\"alidade_tables.so\"")) << inputs;
}

TEST_F(SweepCli, RefusesWhatCannotBeVaried) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"source.noise",
       "error: --vary: 'source.noise' does not name a key to vary; expected KEY=v1,v2,..."},
      {"=1,2", "'=1,2' does not name a key to vary"},
      {"a.b=1,,2", "'a.b=1,,2' has an empty value"},
      {"a.b=", "'a.b=' has an empty value"},
      {"a.b=[1,2", "has an unclosed bracket or quote"},
      {"a.b=1,2,1", "has the value '1' twice"}};
  for (const auto& [text, words] : wrong) {
    const Outcome sweep = Call({"sweep", "config.yaml", "--runs", "1", "--vary", text});
    EXPECT_EQ(sweep.code, 2) << text;
    EXPECT_TRUE(Contains(sweep.err, words)) << sweep.err;
  }
  const std::vector<std::pair<std::string, std::string>> unknown = {
      {"sensors.stereo.sigma_pix=1,2",
       "error: --vary sensors.stereo.sigma_pix: unknown key; did "
       "you mean 'sigma_px'?"},
      {"sensors.sterio.sigma_px=1,2",
       "error: --vary sensors.sterio.sigma_px: the config does not contain 'sensors.sterio'; "
       "expected a key of an existing map; did "
       "you mean 'stereo'?"},
      {"sensors.stereo.sigma_px=1,-2", "error: --vary sensors.stereo.sigma_px: "},
      {"source.seed=1,2", "error: --vary source.seed: the seed cannot be varied"}};
  for (const auto& [text, words] : unknown) {
    const Outcome sweep =
        Call({"sweep", "config.yaml", "--runs", "1", "-o", "out", "--vary", text});
    EXPECT_EQ(sweep.code, 78) << text;
    EXPECT_TRUE(Contains(sweep.err, words)) << sweep.err;
    EXPECT_FALSE(Exists("out"));
  }
}

TEST_F(SweepCli, StopsAtASignalWithTheRunsThatAreComplete) {
  const pid_t sweep =
      Start({"sweep", "config.yaml", "--runs", "1000000", "--jobs", "2", "-o", "out"});
  ASSERT_TRUE(Eventually([&] { return !Read("out.partial/finished_runs.jsonl").empty(); }));
  ::kill(sweep, SIGTERM);
  const Outcome stopped = Wait(sweep);
  EXPECT_EQ(stopped.code, 75) << stopped.err;
  EXPECT_FALSE(Exists("out"));
  EXPECT_TRUE(Contains(stopped.out, "\nreport   out.partial/report.html\n")) << stopped.out;
  const Config summary = Json("out.partial/sweep.json");
  EXPECT_EQ(summary.root().At("runs").Number(), 1e6);
  EXPECT_EQ(summary.root().At("status").Text(), "stopped");
  EXPECT_GT(summary.root().At("runs_used").Number(), 0);
  EXPECT_TRUE(Contains(stopped.err, "stopped after ")) << stopped.err;
}

}  // namespace
}  // namespace alidade
