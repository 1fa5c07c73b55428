// SPDX-License-Identifier: Apache-2.0
//
// Tests the output folders of the program and the error messages about them.
#include <cmath>

#include "alidade/config/config.h"
#include "support/program.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::Arguments;
using testing::Contains;
using testing::Outcome;
using OutputCli = testing::ProgramTest;

// The output folder has the same name for all spellings of a config's path.
TEST_F(OutputCli, OutputIsCalledAsTheConfig) {
  fs::create_directory(folder_ / "05_depth");
  const fs::path folder = fs::absolute(folder_ / "05_depth");
  for (const std::string name : {"config.yaml", "base.yaml"}) {
    fs::copy_file(folder_ / "config.yaml", folder / name);
    const std::string output = name == "config.yaml" ? "05_depth" : "base";
    for (const std::string& config :
         {"05_depth/" + name, "./05_depth/../05_depth/" + name, (folder / name).string()}) {
      const Outcome run = Call({"run", config, "--force"});
      EXPECT_EQ(run.code, 0) << run.err;
      EXPECT_TRUE(Contains(run.out, "report   runs/" + output + "/report.html\n")) << config << '\n'
                                                                                   << run.out;
    }
    fs::remove_all(folder_ / "runs");
    const fs::path before = folder_;
    folder_ = folder;
    EXPECT_EQ(Call({"run", name}).code, 0);
    EXPECT_TRUE(Exists("runs/" + output + "/run.json"));
    folder_ = before;
  }
}

TEST_F(OutputCli, OutputIsNotTheFolderOfAllRuns) {
  const auto expect = [&](const Arguments& more, int code, const std::string& text) {
    for (const Arguments& command :
         {Arguments{"run", "config.yaml"}, {"sweep", "config.yaml", "--runs", "1"}}) {
      Arguments all = command;
      all.insert(all.end(), more.begin(), more.end());
      const Outcome outcome = Call(all);
      EXPECT_EQ(outcome.code, code) << outcome.err;
      EXPECT_TRUE(outcome.err.starts_with("error: " + text + '\n')) << outcome.err;
    }
  };
  const std::string holds = " is the folder that contains all runs; expected ";
  for (const std::string folder : {"runs", "./runs/", "runs/a/.."}) {
    expect({"-o", folder, "--force"}, 73, folder + ": this" + holds + "runs/NAME");
  }
  expect({"--set", "output=\"\""}, 78,
         "--set output: the path is empty; expected a name inside runs/");
  expect({"--set", "output=."}, 78, "--set output: '.'" + holds + "a name inside runs/");
  Write("config.yaml", "output: a/..\n" + testing::kDepthConfig);
  expect({}, 78, "config.yaml:1:9 output: 'a/..'" + holds + "a name inside runs/");
  EXPECT_FALSE(Exists("runs"));
}

TEST_F(OutputCli, OutputGoesWhereItIsNamed) {
  const auto run_into = [&](const char* output, const Arguments& more) {
    Arguments all = {"run", "config.yaml", "--set", output};
    all.insert(all.end(), more.begin(), more.end());
    return Call(all).code;
  };
  EXPECT_EQ(run_into("output=own/name", {}), 0);
  EXPECT_TRUE(Exists("runs/own/name/run.json"));
  EXPECT_EQ(run_into("output=../out", {}), 77);
  EXPECT_FALSE(Exists("out"));
  EXPECT_EQ(run_into("output=../out", {"--allow-outside"}), 0);
  EXPECT_TRUE(Exists("out/run.json"));
  const Outcome again = Call({"run", "config.yaml", "-o", "out"});
  EXPECT_EQ(again.code, 73);
  EXPECT_TRUE(Contains(again.err, "--force")) << again.err;
  const Outcome endless = Call({"run", "config.yaml", "-o", std::string(300, 'x')});
  EXPECT_EQ(endless.code, 73);
  EXPECT_TRUE(Contains(endless.err, "xxx.partial: cannot create: File name too long"))
      << endless.err;
}

TEST_F(OutputCli, NumbersOutOfRangeAreShownAsTyped) {
  const auto expect = [&](const Arguments& arguments, const std::string& text) {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(outcome.err.starts_with("error: " + text)) << outcome.err;
  };
  const std::string seeds = "' is not an integer from 0 to 9223372036854775807";
  for (const std::string seed :
       {"99999999999999999999999", "9223372036854775808", "-1", "1e3", "0x10", " 1", "1.0"}) {
    expect({"run", "config.yaml", "--seed=" + seed}, "--seed: '" + seed + seeds);
  }
  expect({"run", "config.yaml", "--seed", "010"}, "--seed: '010' has a leading zero");
  expect({"sweep", "config.yaml", "--runs", "08"}, "--runs: '08' has a leading zero");
  expect({"sweep", "config.yaml", "--runs", "1000001"},
         "--runs: '1000001' is not an integer from 1 to 1000000");
  expect({"sweep", "config.yaml", "--runs", "1", "--jobs", "4294967297"},
         "--jobs: '4294967297' is not an integer from 1 to 1024");
  expect({"sweep", "config.yaml", "--runs", "1", "--first-seed", "4611686018427387905"},
         "--first-seed: '4611686018427387905' is not an integer from 0 to 4611686018427387904");
  EXPECT_EQ(Call({"run", "config.yaml", "--seed", "9223372036854775807"}).code, 0);
  EXPECT_TRUE(Contains(Read("runs/config/run.json"), "\"seed\": 9223372036854775807"));
}

TEST_F(OutputCli, ErrorsObeyNoControlCharacters) {
  Write("table.csv",
        "t_s,\x1b[31md,\xc2\x9b"
        "1m,\xc3\xbc\n0,80,1,2\n");
  const Outcome run = Call({"run", "table.yaml"});
  EXPECT_EQ(run.code, 78);
  EXPECT_TRUE(Contains(run.err, "expected one of t_s, ?[31md, ?1m, \xc3\xbc")) << run.err;
  const Outcome missing = Call({"run", "\x1b[31m.yaml"});
  EXPECT_EQ(missing.code, 66);
  EXPECT_TRUE(missing.err.starts_with("error: ?[31m.yaml: ")) << missing.err;
  const Outcome raw = Call({"run", "\x9b\xff.yaml"});
  EXPECT_TRUE(raw.err.starts_with("error: ??.yaml: ")) << raw.err;
}

/// Returns the number in column `column` (counted from 0) of the row that begins with `start`.
double Cell(const std::string& csv, const std::string& start, int column) {
  std::istringstream row(csv.substr(csv.find('\n' + start) + 1));
  std::string cell;
  for (int i = 0; i <= column; ++i) std::getline(row, cell, ',');
  return std::stod(cell);
}

TEST_F(OutputCli, MeasurementsStandBesideWhatTruthMakesOfThem) {
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "out"}).code, 0);
  const std::string t = "0.330000000,";
  const double depth = Cell(Read("out/truth.csv"), t, 1);
  const double lambda = Cell(Read("out/truth.csv"), t, 3);
  EXPECT_NEAR(depth, 0.3 + 0.1 * std::sin(2 * 3.14159265358979 * 0.4 * 0.33), 1e-12);
  const std::string expected = Read("out/expected.csv"), implied = Read("out/implied_states.csv");
  EXPECT_NEAR(Cell(expected, t + "inverse_scale", 2), lambda * depth, 1e-12);
  EXPECT_NEAR(Cell(expected, t + "disparity,", 2), 26.0 / depth, 1e-9);
  // A measured inverse scale s implies the depth s / lambda.
  const double s = Cell(Read("out/measurements.csv"), t + "inverse_scale,", 3);
  EXPECT_NE(s, lambda * depth);
  EXPECT_NEAR(Cell(implied, t + "scale,", 2), s / lambda, 1e-12);
  const double d = Cell(Read("out/measurements.csv"), t + "disparity,", 3);
  EXPECT_NEAR(Cell(implied, t + "stereo,", 2), 26.0 / d, 1e-12);
}

// Without -o a second run is not refused, and it does not replace the first run.
TEST_F(OutputCli, ASecondRunGoesToANumberedFolder) {
  const Arguments run = {"run", "config.yaml"};
  const Outcome first = Call(run), second = Call(run);
  EXPECT_EQ(first.err, "");
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_EQ(second.err,
            "runs/config exists: the output is runs/config-2 (--force replaces runs/config)\n");
  EXPECT_TRUE(Contains(second.out, "\nreport   runs/config-2/report.html\n")) << second.out;
  EXPECT_TRUE(Exists("runs/config-2/run.json"));
  const Outcome third = Call({"run", "config.yaml", "--quiet"});
  EXPECT_EQ(third.err, "");
  EXPECT_TRUE(Exists("runs/config-3/run.json"));
  EXPECT_EQ(Call({"run", "config.yaml", "--force"}).err, "");
  EXPECT_FALSE(Exists("runs/config-4"));
  for (const std::string name : {"own", "own-2"}) {
    EXPECT_EQ(Call({"run", "config.yaml", "--set", "output=own"}).code, 0);
    EXPECT_TRUE(Exists("runs/" + name + "/run.json"));
  }
  EXPECT_EQ(Call({"run", "config.yaml", "-o", "runs/own"}).code, 73);
  // The folder of an incomplete run also reserves the name of the run.
  fs::create_directory(folder_ / "runs/left.partial");
  EXPECT_EQ(Call({"run", "config.yaml", "--set", "output=left"}).err,
            "runs/left.partial exists: the output is runs/left-2 (--force replaces "
            "runs/left.partial)\n");
  EXPECT_EQ(Call({"run", "config.yaml", "-o", "runs/left"}).code, 73);
}

TEST_F(OutputCli, ARefusedConfigNamesNoFolder) {
  fs::create_directories(folder_ / "runs/there");
  for (const std::string command : {"run", "simulate", "sweep", "compare"}) {
    Arguments line = {command, "config.yaml", "--set", "output=there"};
    if (command == "sweep") line.insert(line.end(), {"--runs", "2"});
    const Outcome good = Call(line);
    EXPECT_TRUE(Contains(good.err, "runs/there exists: the output is runs/there-"))
        << command << good.err;
    line.insert(line.end(), {"--set", "source.sede=1"});
    const Outcome refused = Call(line);
    EXPECT_EQ(refused.code, 78) << command << refused.err;
    EXPECT_FALSE(Contains(refused.err, "exists")) << command << refused.err;
  }
}

TEST_F(OutputCli, RunPrintsTheRelevantRowsAndAllOfThemIfAsked) {
  const auto labels = [](const std::string& out) {
    std::vector<std::string> found;
    std::istringstream lines(out);
    std::string line;
    while (std::getline(lines, line) && !line.empty()) {  // skips the verdicts
    }
    std::getline(lines, line);  // skips the column names
    while (std::getline(lines, line) && !line.empty()) {
      found.push_back(line.substr(0, line.find("  ")));
    }
    return found;
  };
  const Outcome relevant = Call({"run", "config.yaml"});
  EXPECT_EQ(labels(relevant.out),
            (std::vector<std::string>{
                "verdict", "rmse target.depth [mm]", "rmse target.depth_rate [mm/s]",
                "rmse template.inverse_distance [1/m]", "NEES target", "NEES template",
                "NIS stereo", "NIS scale", "used / given stereo", "used / given scale"}))
      << relevant.out;
  const Outcome all = Call({"run", "config.yaml", "--all"});
  const std::size_t rows = labels(all.out).size();
  EXPECT_GT(rows, 10u) << all.out;
  EXPECT_TRUE(Contains(relevant.out, '\n' + std::to_string(rows - 10) + " more rows: --all\n"))
      << relevant.out;
  EXPECT_FALSE(Contains(all.out, "more rows")) << all.out;
}

TEST_F(OutputCli, TheConfigSelectsTheRows) {
  Write("rows.yaml",
        testing::kDepthConfig +
            "report: {rows: [lag_ms:target.depth, accepted:stereo, nis.mean:scale]}\n");
  const std::string out = Call({"run", "rows.yaml"}).out;
  const std::size_t lag = out.find("\nlag target.depth [ms] "),
                    used = out.find("\nused / given stereo "), nis = out.find("\nNIS scale ");
  EXPECT_LT(lag, used) << out;
  EXPECT_LT(used, nis) << out;
  EXPECT_NE(nis, out.npos) << out;
  EXPECT_FALSE(Contains(out, "rmse ")) << out;
  const Outcome unknown =
      Call({"run", "config.yaml", "--set", "report={rows: [rmse:target.dept]}"});
  EXPECT_EQ(unknown.code, 78);
  EXPECT_TRUE(Contains(unknown.err, "report.rows[0]: metric 'rmse:target.dept' does not exist"))
      << unknown.err;
  EXPECT_TRUE(Contains(unknown.err, "did you mean 'rmse:target.depth'?")) << unknown.err;
  EXPECT_EQ(Call({"run", "config.yaml", "--set", "report={row: []}"}).code, 78);
}

TEST_F(OutputCli, SaysThatTheCurrentFolderIsGone) {
  fs::create_directory(folder_ / "gone");
  before_ = "cd gone; rmdir ../gone";
  const std::string config = (folder_ / "config.yaml").string();
  const auto expect = [&](const Arguments& arguments) {
    fs::create_directory(folder_ / "gone");
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 73) << outcome.err;
    EXPECT_TRUE(
        Contains(outcome.err, ": the current folder no longer exists; change to an existing"))
        << outcome.err;
  };
  expect({"run", config});
  expect({"run", config, "-o", "out"});
  expect({"run", config, "--set", "output=out"});
  expect({"run", config, "-o", (folder_ / "out").string(), "--plugin-path", "plugins"});
  expect({"sweep", config, "--runs", "1"});
  fs::create_directory(folder_ / "gone");
  const Outcome run = Call({"run", config, "-o", (folder_ / "out").string()});
  EXPECT_EQ(run.code, 0) << run.err;
}

}  // namespace
}  // namespace alidade
