// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <filesystem>
#include <regex>

#include "alidade/config/config.h"
#include "support/program.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;
namespace fs = std::filesystem;

/// For tests that do not need the batch estimator, which a build without the Ceres solver does not
/// contain.
class CompareFolderCli : public testing::ProgramTest {};

TEST_F(CompareFolderCli, SaysHowManyRowsAreNotFinite) {
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "out"}).code, 0);
  EXPECT_FALSE(Contains(Call({"compare", "out"}).out, "not finite"));
  std::istringstream rows(Read("out/ekf/estimates.csv"));
  std::string text;
  int count = -1;  // the header is not counted
  for (std::string row; std::getline(rows, row); ++count) {
    const std::size_t first = row.find(','), second = row.find(',', first + 1);
    if (count == 3 || count == 7) row.replace(first + 1, second - first - 1, "nan");
    if (count == 9) row.replace(first + 1, second - first - 1, "-inf");
    text += row + '\n';
  }
  Write("out/ekf/estimates.csv", text);
  const std::string note = "out/ekf/estimates.csv': 3 of " + std::to_string(count) +
                           " rows contain values that are not finite; the comparison ignores these "
                           "values";
  EXPECT_TRUE(Contains(Call({"compare", "out"}).out, note)) << Call({"compare", "out"}).out;
  EXPECT_TRUE(Contains(Call({"compare", "out", "--json"}).out, note));
}

class CompareCli : public testing::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (!Contains(Call({"plugins", "list"}).out, "ceres_batch")) {
      GTEST_SKIP() << "this build contains no batch estimator";
    }
  }
  /// Returns the JSON text of a comparison without the entries that contain times.
  static std::string WithoutClock(const std::string& json) {
    const std::regex clock(R"=(\n *"(time_us|cpu_us|cpu_us.start)": (\{[^}]*\},?|[^\n]*))=");
    return std::regex_replace(json, clock, "");
  }
  /// Writes disparities of a target at 0.3 m, every 0.1 s from 0.1 s to 2 s.
  void WriteTable(const std::string& name, const std::string& fifth = "86.5") const {
    std::string text = "t_s,d\n";
    for (int k = 1; k <= 20; ++k) {
      text += std::to_string(0.1 * k) + ',' + (k == 5 ? fifth : "86.66666") + '\n';
    }
    Write(name, text);
  }
  Outcome Table(const std::string& table, const std::string& folder) const {
    return Call({"run", "table.yaml", "--set", "source.path=" + table, "-o", folder, "--quiet"});
  }
};

TEST_F(CompareCli, AConfigIsRunAndItsErrorDecomposed) {
  const Outcome compared =
      Call({"compare", "config.yaml", "--all", "-o", "out", "--full-information", "always"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  for (const char* words :
       {"'full_information' was added", "RMSD target.depth [mm]",
        "Online: estimates that use only past data", "Smoothed: estimates that also use later data",
        "At the end, when all estimators have the same data",
        "linearisation, ekf compared with full_information", "smoothing, ekf compared with rts",
        "rejected measurements, batch_accepted compared with batch",
        "of 227 measurements were not used", "rmse target.depth [mm]", "CPU time [us/frame]",
        "  of the initial filter", "ratios are from one run and have no confidence interval"}) {
    EXPECT_TRUE(Contains(compared.out, words)) << words << '\n' << compared.out;
  }
  const Config json = Json("out/compare.json"), run = Json("out/run.json");
  const Node ekf = json.root().At("estimators").At("ekf");
  EXPECT_EQ(ekf.At("values").At("rmse:target.depth").Number(),
            run.root().At("estimators").At("ekf").At("metrics").At("rmse:target.depth").Number());
  EXPECT_EQ(json.root().At("measurements_sha256").Text(),
            run.root().At("data").At("measurements").Text());
  EXPECT_TRUE(Contains(Read("out/files.txt"), "compare.json"));
  EXPECT_TRUE(Contains(Read("out/compare.tex"), "\\begin{tabular}{lrr}"))
      << Read("out/compare.tex");
  EXPECT_TRUE(Contains(Read("out/compare.tex"), "full\\_information"));
  EXPECT_TRUE(Contains(Read("out/compare.md"), "| rmse target.depth [mm] | "));
}

// Neither run can be compared: the first run fails, and the second run contains no truth, so it has
// no errors relative to truth. The folders of both runs are retained, and the program reports the
// reason.
TEST_F(CompareCli, ARunThatCannotBeComparedIsKept) {
  const auto compare = [&](const std::string& rows, const std::string& folder) {
    Write("bad.csv", "t_s,d,z\n" + rows);
    return Call({"compare", "table.yaml", "--set", "source.path=bad.csv", "--set",
                 "source.truth={target.depth: z}", "--reference", "truth", "-o", folder});
  };
  const Outcome broken = compare("0,x,0.3\n", "broken");
  EXPECT_EQ(broken.code, 65);
  EXPECT_TRUE(Contains(broken.err, "bad.csv:2")) << broken.err;
  EXPECT_TRUE(Contains(Read("broken/run.json"), "\"failed\""));
  const Outcome blind = compare("0,86,\n0.1,86,\n", "blind");
  EXPECT_EQ(blind.code, 2);
  EXPECT_TRUE(Contains(blind.err, "--reference: no run has errors relative to truth")) << blind.err;
  EXPECT_TRUE(Contains(Read("blind/run.json"), "\"ok\""));
}

// `compare` prints the same values, including covariances, when it performs a run and when it reads
// the folder of this run.
TEST_F(CompareCli, TheFolderOfARunTellsTheSame) {
  ASSERT_EQ(Call({"compare", "config.yaml", "-o", "out", "--quiet"}).code, 0);
  const Outcome compared = Call({"compare", "out", "--json"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  const auto values = [](const std::string& json) {
    const std::string text = WithoutClock(json);
    return text.substr(0, text.find("\"notes\""));
  };
  EXPECT_EQ(values(compared.out), values(Read("out/compare.json")));
  EXPECT_TRUE(Contains(compared.out, "rmsd.sigmas:target"));
}

TEST_F(CompareCli, OfSeveralFoldersEstimatorsAreNamedByTheirs) {
  ASSERT_EQ(Call({"compare", "config.yaml", "-o", "runs/a", "--quiet"}).code, 0);
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "runs/b", "--set", "estimators.ekf.gate=0.5"}).code,
            0);
  const Outcome compared = Call({"compare", "runs/a", "runs/b", "-o", "both"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  EXPECT_TRUE(Contains(compared.out, "  b/ekf")) << compared.out;
  EXPECT_FALSE(Contains(compared.out, "covariance.bin")) << compared.out;
  EXPECT_FALSE(Contains(compared.out, "differ:")) << compared.out;
  const Config both = Json("both/compare.json");
  const Node all = both.root().At("estimators");
  EXPECT_EQ(all.At("b/ekf").At("reference").Text(), "a/full_information");
  before_ = "cd runs/a";
  EXPECT_TRUE(Contains(Call({"compare", ".", "../b"}).out, "  a/ekf"));
}

// Tests fault 86 of tests/faults/README.md.
TEST_F(CompareCli, RefusesRunsOverDifferentData) {
  WriteTable("one.csv");
  WriteTable("other.csv", "86.25");
  ASSERT_EQ(Table("one.csv", "a").code, 0);
  ASSERT_EQ(Table("other.csv", "b").code, 0);
  const auto hash = [&](const std::string& folder) {
    return Json(folder + "/run.json").root().At("data").At("measurements").Text();
  };
  const Outcome compared = Call({"compare", "a", "b"});
  EXPECT_EQ(compared.code, 65);
  EXPECT_EQ(compared.out, "");
  EXPECT_EQ(compared.err, "error: b: the measurements differ from those of 'a': the SHA-256 is " +
                              hash("b") + ", not " + hash("a") +
                              "; the first difference is at t = 0.500000000 s; expected runs of "
                              "the same source, seed and start\n");
  Write("a/measurements.csv", "t_s,stereo\n0.1\n0.1\n");
  const Outcome damaged = Call({"compare", "a", "b"});
  EXPECT_EQ(damaged.code, 65);
  EXPECT_TRUE(Contains(damaged.err, "b: the measurements differ from those of 'a'")) << damaged.err;
}

// Tests fault 86 of tests/faults/README.md: the same numbers in a different notation are the same
// data.
TEST_F(CompareCli, HashesWhatIsMeasuredNotItsText) {
  WriteTable("one.csv");
  WriteTable("other.csv", "+865e-1");
  ASSERT_EQ(Table("one.csv", "a").code, 0);
  ASSERT_EQ(Table("other.csv", "b").code, 0);
  EXPECT_EQ(Call({"compare", "a", "b", "--reference", "a/ekf"}).code, 0);
}

// Tests fault 86 of tests/faults/README.md: the second run processed fewer data.
TEST_F(CompareCli, TellsWhereARunEndsEarlier) {
  WriteTable("one.csv");
  Write("other.csv", Read("one.csv").substr(0, Read("one.csv").find("1.500000")));
  ASSERT_EQ(Table("one.csv", "a").code, 0);
  ASSERT_EQ(Table("other.csv", "b").code, 0);
  const Outcome compared = Call({"compare", "a", "b"});
  EXPECT_EQ(compared.code, 65);
  EXPECT_TRUE(Contains(compared.err, "the end of the file, the other file has t = 1.500000000 s"))
      << compared.err;
}

TEST_F(CompareCli, WarnsOfSettingsAndTruthsThatDiffer) {
  WriteTable("table.csv");
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "a"}).code, 0);
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "b", "--set", "sensors.stereo.sigma_px=2"}).code, 0);
  const Outcome compared = Call({"compare", "a", "b", "--reference", "a/ekf"});
  EXPECT_TRUE(Contains(compared.out, "'a/ekf' has no covariance.bin")) << compared.out;
  EXPECT_TRUE(Contains(compared.out,
                       "the settings of 'a' and 'b' differ: sensors.stereo.sigma_px "
                       "(1.0, 2)"))
      << compared.out << compared.err;
}

TEST_F(CompareCli, CovariancesOfARunAreWrittenWhereAskedFor) {
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "a", "--covariances"}).code, 0);
  // The file has 152 frames, each with the lower triangle of a 3 x 3 matrix.
  EXPECT_EQ(Read("a/ekf/covariance.bin").size(), 152u * 6u * 8u);
  const Outcome compared = Call({"compare", "a", "--reference", "ekf"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  EXPECT_FALSE(Contains(compared.out, "covariance.bin")) << compared.out;
}

TEST_F(CompareCli, RefusesASourceThatCanBeReadOnceForSeveralSeeds) {
  ASSERT_EQ(::mkfifo((folder_ / "table.csv").c_str(), 0600), 0);
  const Outcome compared = Call({"compare", "table.yaml", "--runs", "2", "-o", "out"});
  EXPECT_EQ(compared.code, 78);
  EXPECT_TRUE(Contains(compared.err, "can be read only once")) << compared.err;
}

// Tests fault 85 of tests/faults/README.md.
TEST_F(CompareCli, WithholdsTheComparisonWhereTheBatchFailed) {
  const std::string failing = "estimators.batch={type: ceres_batch, max_iterations: 1}";
  const Outcome compared = Call({"compare", "config.yaml", "-o", "out", "--reference", "batch",
                                 "--no-decomposition", "--set", failing});
  EXPECT_EQ(compared.code, 1);
  const std::string words =
      "no reference is available: estimator 'batch' failed, so the comparison with this "
      "estimator is withheld";
  EXPECT_TRUE(Contains(compared.err, "error: " + words)) << compared.err;
  EXPECT_TRUE(Contains(compared.out, words)) << compared.out;
  EXPECT_FALSE(Contains(compared.out, "difference target")) << compared.out;
  // Errors relative to truth do not need the batch, so they are printed. The comparison with the
  // batch is withheld.
  const Outcome truth =
      Call({"compare", "config.yaml", "-o", "two", "--no-decomposition", "--set", failing});
  EXPECT_EQ(truth.code, 1);
  EXPECT_TRUE(Contains(truth.out, "rmse target.depth [mm]")) << truth.out;
  // There is no gate, so the batch of the accepted measurements uses all measurements. This batch
  // replaces the batch that failed.
  const Outcome added = Call({"compare", "config.yaml", "-o", "three", "--set", failing});
  EXPECT_EQ(added.code, 79) << "expected the exit code of the run";
  EXPECT_FALSE(Contains(added.out, words)) << added.out;
  EXPECT_TRUE(Contains(added.out, "to batch_accepted")) << added.out;
  // `compare` on the finished folder exits with the same code.
  EXPECT_EQ(Call({"compare", "out", "--reference", "batch"}).code, 1);
}

// Tests fault 85 of tests/faults/README.md: if several folders are compared, the batch of any one
// of them is sufficient.
TEST_F(CompareCli, TheBatchOfAnotherFolderServesWhereOneFailed) {
  const auto run = [this](const std::string& folder, const std::string& batch) {
    return Call({"run", "config.yaml", "-o", folder, "--quiet", "--covariances", "--set",
                 "estimators.batch=" + batch})
        .code;
  };
  ASSERT_NE(run("fa", "{type: ceres_batch, max_iterations: 1}"), 0);
  ASSERT_EQ(run("fb", "{type: ceres_batch}"), 0);
  for (const Arguments& folders : {Arguments{"fa", "fb"}, Arguments{"fb", "fa"}}) {
    const Outcome compared = Call({"compare", folders[0], folders[1]});
    EXPECT_EQ(compared.code, 0) << compared.err;
    EXPECT_TRUE(Contains(compared.out, "to fb/batch")) << compared.out;
  }
}

// A fixed-lag smoother relinearises. Each estimate uses the data up to the end of the window.
TEST_F(CompareCli, AWindowIsNeitherAFilterNorASmootherOfAllData) {
  const std::string window = "estimators.window={type: fixed_lag, lag_s: 0.5";
  const Outcome smoothed =
      Call({"compare", "config.yaml", "-o", "out", "--no-decomposition", "--set",
            window + ", output: lagged}", "--set", "estimators.rts={type: rts}"});
  EXPECT_TRUE(Contains(smoothed.out, "later data; ratios and differences relative to rts"))
      << smoothed.out << smoothed.err;
  const Outcome online =
      Call({"compare", "config.yaml", "-o", "two", "--filter", "window", "--set", window + '}'});
  EXPECT_EQ(online.code, 2);
  EXPECT_TRUE(Contains(online.err, "expected one of ekf")) << online.err;
}

TEST_F(CompareCli, WithoutTruthTheBatchIsTheReference) {
  WriteTable("table.csv");
  const Outcome compared = Call({"compare", "table.yaml", "-o", "out"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  EXPECT_TRUE(Contains(compared.out, "20 frames, differences from batch")) << compared.out;
  EXPECT_FALSE(Contains(compared.out, "rmse")) << compared.out;
  const Config json = Json("out/compare.json");
  const Node estimators = json.root().At("estimators");
  EXPECT_EQ(estimators.At("ekf").At("reference").Text(), "full_information");
  EXPECT_EQ(estimators.At("rts").At("reference").Text(), "batch");
  EXPECT_GT(estimators.At("ekf").At("values").At("rmsd.sigmas:target").Number(), 0.0);
  const Outcome truth = Call({"compare", "table.yaml", "-o", "two", "--reference", "truth"});
  EXPECT_EQ(truth.code, 2);
  EXPECT_TRUE(Contains(truth.err, "--reference: the source does not provide truth")) << truth.err;
  EXPECT_FALSE(Exists("two"));
}

// If an error in the data ends a run, the comparison uses the frames before the error.
TEST_F(CompareCli, ExitsWithTheCodeOfARunThatFailed) {
  WriteTable("table.csv", "no_number");
  const Outcome compared = Call({"compare", "table.yaml", "-o", "out"});
  EXPECT_EQ(compared.code, 65);
  EXPECT_TRUE(Contains(compared.err, "table.csv:6:10 d: 'no_number' is not a number"))
      << compared.err;
  EXPECT_EQ(Json("out/compare.json").root().At("status").Text(), "failed");
  EXPECT_EQ(Call({"compare", "out"}).code, 1) << "no batch has finished";
}

// `compare` reports the rejection recovery when it performs the run and when it reads the run's
// folder.
TEST_F(CompareCli, TellsOfRejectionRecovery) {
  WriteTable("table.csv");
  std::string text = Read("table.csv");
  for (int k = 21; k <= 50; ++k) text += std::to_string(0.1 * k) + ",26\n";
  Write("table.csv", text);
  const std::string words =
      "'ekf' recovered from consecutive rejections: the steps to a batch or smoother include the "
      "cost of this recovery";
  const Outcome compared =
      Call({"compare", "table.yaml", "-o", "out", "--set",
            "estimators.ekf={type: ekf, gate: 0.99, rejection_recovery: {after: 2}}"});
  EXPECT_TRUE(Contains(compared.out, words)) << compared.out << compared.err;
  EXPECT_TRUE(Contains(Call({"compare", "out"}).out, words)) << Read("out/ekf/events.csv");
}

TEST_F(CompareCli, OverSeedsValuesHaveASpread) {
  const auto compare = [](const char* jobs, const char* folder) {
    return Arguments{"compare", "config.yaml", "--runs", "3",   "--set", "source.duration_s=2",
                     "--jobs",  jobs,          "-o",     folder};
  };
  const Outcome compared = Call(compare("1", "one"));
  EXPECT_EQ(compared.code, 0) << compared.err;
  EXPECT_TRUE(Contains(compared.out, "3 runs, mean, errors relative to truth")) << compared.out;
  const auto rmse = [](const Node& of, const char* where, const char* what) {
    return of.At("estimators").At("ekf").At(where).At("rmse:target.depth").At(what).Number();
  };
  const Config json = Json("one/compare.json"), summary = Json("one/sweep.json");
  for (const char* what : {"mean", "p05", "p95"}) {
    EXPECT_EQ(rmse(json.root(), "values", what), rmse(summary.root(), "metrics", what));
  }
  EXPECT_LT(rmse(json.root(), "values", "p05"), rmse(json.root(), "values", "p95"));
  EXPECT_TRUE(Contains(compared.out, "95 % interval (paired bootstrap")) << compared.out;
  const Node estimators = json.root().At("estimators"), rts = estimators.At("rts").At("values");
  const auto mean = [](const Node& values) {
    return values.At("rmse:target.depth").At("mean").Number();
  };
  const Node ratio = rts.At("ratio.rmse:target.depth");
  EXPECT_NEAR(ratio.At("value").Number(), mean(rts) / mean(estimators.At("batch").At("values")),
              1e-12);
  EXPECT_LE(ratio.At("low").Number(), ratio.At("value").Number());
  EXPECT_GE(ratio.At("high").Number(), ratio.At("value").Number());
  EXPECT_EQ(ratio.At("runs").Number(), 3);
  const Node anees = estimators.At("ekf").At("anees").At("target");
  EXPECT_EQ(anees.At("timestamps").Number(), 61);
  EXPECT_EQ(std::ssize(anees.At("mean").Items()), 61);
  // The tabulated bounds of chi-square with six degrees of freedom are 1.237 and 14.449.
  EXPECT_NEAR(anees.At("low").Items()[0].Number(), 1.237 / 6.0, 1e-3);
  EXPECT_NEAR(anees.At("high").Items()[0].Number(), 14.449 / 6.0, 1e-3);
  ASSERT_EQ(Call(compare("2", "two")).code, 0);
  EXPECT_EQ(WithoutClock(Read("one/compare.json")), WithoutClock(Read("two/compare.json")));
}

/// Returns the numbers in a column of a csv file without quotes. Empty cells are omitted.
std::vector<double> ColumnOf(const std::string& csv, const std::string& name) {
  std::istringstream rows(csv);
  std::vector<double> numbers;
  std::size_t column = 0;
  bool found = false;
  for (std::string row; std::getline(rows, row);) {
    std::istringstream cells(row);
    std::string cell;
    if (!found) {
      while (std::getline(cells, cell, ',') && cell != name) ++column;
      found = true;
      continue;
    }
    for (std::size_t i = 0; i <= column; ++i) std::getline(cells, cell, ',');
    if (!cell.empty()) numbers.push_back(std::stod(cell));
  }
  return numbers;
}

// The values of over_time.csv, averaged over time, equal the metrics of whole runs.
TEST_F(CompareCli, ErrorsOverTimeAreThoseOfTheRuns) {
  const Outcome compared = Call({"compare", "config.yaml", "--runs", "3", "--set",
                                 "source.duration_s=2", "--jobs", "1", "-o", "out"});
  ASSERT_EQ(compared.code, 0) << compared.err;
  const std::string csv = Read("out/over_time.csv");
  const Config json = Json("out/compare.json");
  const Node ekf = json.root().At("estimators").At("ekf"), values = ekf.At("values");
  // The 5 %, 50 % and 95 % quantiles of three values a <= b <= c are
  // a + 0.1 (b - a), b and b + 0.9 (c - b).
  const auto of = [&](const char* what) {
    return values.At("rmse:target.depth").At(what).Number();
  };
  const double b = of("p50"), a = (of("p05") - 0.1 * b) / 0.9, c = (of("p95") - 0.1 * b) / 0.9;
  double square = 0.0;
  const std::vector<double> rms = ColumnOf(csv, "ekf.rms:target.depth");
  for (const double value : rms) square += value * value / static_cast<double>(rms.size());
  EXPECT_NEAR(square, (a * a + b * b + c * c) / 3.0, 1e-9 * square);
  double nees = 0.0;
  const std::vector<double> anees = ColumnOf(csv, "ekf.anees:target");
  for (const double value : anees) nees += value / static_cast<double>(anees.size());
  EXPECT_NEAR(nees, values.At("nees.mean:target").At("mean").Number(), 1e-9);
  const std::vector<double> low = ColumnOf(csv, "ekf.p16:target.depth");
  const std::vector<double> high = ColumnOf(csv, "ekf.p84:target.depth");
  ASSERT_EQ(low.size(), rms.size());
  for (std::size_t k = 0; k < low.size(); ++k) EXPECT_LE(low[k], high[k]);
}

TEST_F(CompareCli, OverSeedsThereIsAPageAndTheCost) {
  const Outcome compared = Call({"compare", "config.yaml", "--runs", "2", "--set",
                                 "source.duration_s=2", "--jobs", "1", "-o", "out"});
  ASSERT_EQ(compared.code, 0) << compared.err;
  EXPECT_TRUE(compared.out.ends_with("\nreport   out/report.html\n")) << compared.out;
  EXPECT_TRUE(Contains(Read("out/files.txt"), "\nreport.html\n"));
  const std::string page = Read("out/report.html");
  for (const char* column : {"ekf.rms:target.depth", "ekf.anees:target"}) {
    EXPECT_TRUE(Contains(page, std::string(1, '"') + column + "\":")) << column;
  }
  EXPECT_TRUE(Contains(page, " --runs 2 --first-seed 1"));
  // cpu_us is the CPU time of a batch alone. cpu_us.all includes the filter from which the batch
  // starts.
  const std::string csv = Read("out/cost.csv");
  const auto own = ColumnOf(csv, "cpu_us"), all = ColumnOf(csv, "cpu_us.all");
  ASSERT_EQ(own.size(), all.size());
  for (std::size_t i = 0; i < own.size(); ++i) EXPECT_LE(own[i], all[i]);
  EXPECT_FALSE(Contains(Read("out/compare.tex"), "rule"));
}

// The first run is always made, even if it exceeds the budget.
TEST_F(CompareCli, BeginsNoRunBeyondTheBudget) {
  const Outcome compared =
      Call({"compare", "config.yaml", "--runs", "5", "--first-seed", "11", "--jobs", "1",
            "--budget", "0.01", "--set", "source.duration_s=2", "-o", "out"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  const std::string words =
      "the budget of 0.01 s sufficed for 1 of 5 runs; seed 12 and the later seeds were not run";
  EXPECT_TRUE(Contains(compared.out, words)) << compared.out;
  const Config json = Json("out/compare.json");
  EXPECT_EQ(json.root().At("runs").Number(), 1);
  EXPECT_EQ(json.root().At("status").Text(), "ok");
}

TEST_F(CompareCli, AddsNothingBeyondTheBudget) {
  const Outcome little = Call({"compare", "config.yaml", "--budget", "1e-9", "-o", "little"});
  EXPECT_EQ(little.code, 0) << little.err;
  EXPECT_TRUE(Contains(little.out, "; the prediction uses the first 10 of 152 frames"))
      << little.out;
  EXPECT_TRUE(Contains(little.out, " s, but the budget is 1e-09 s")) << little.out;
  EXPECT_FALSE(Contains(little.out, "was added")) << little.out;
  const std::string shown = little.out.substr(little.out.find("Error decomposition"));
  EXPECT_TRUE(Contains(shown, "the budget of 1e-09 s excludes some of the omitted estimators"))
      << shown;
  const Outcome much = Call({"compare", "config.yaml", "--budget", "1e6", "-o", "much"});
  ASSERT_EQ(much.code, 0) << much.err;
  ASSERT_EQ(Call({"compare", "config.yaml", "-o", "all"}).code, 0);
  const auto values = [this](const char* folder) {
    const std::string json = WithoutClock(Read(std::string(folder) + "/compare.json"));
    return json.substr(0, json.find("\"notes\""));
  };
  EXPECT_EQ(values("much"), values("all"));
}

TEST_F(CompareCli, StopsAtASignalWithTheSeedsThatAreComplete) {
  const pid_t process = Start({"compare", "config.yaml", "--runs", "1000000", "--set",
                               "source.duration_s=2", "--jobs", "1", "-o", "out"});
  ASSERT_TRUE(
      Eventually([&] { return Contains(Read("stderr"), "the first of 1000000 runs took "); }));
  ::kill(process, SIGTERM);
  const Outcome stopped = Wait(process);
  EXPECT_EQ(stopped.code, 75);
  EXPECT_TRUE(Contains(stopped.err, " of 1000000 runs")) << stopped.err;
  const Config json = Json("out/compare.json");
  EXPECT_EQ(json.root().At("status").Text(), "stopped");
  EXPECT_GT(json.root().At("runs").Number(), 0);
}

TEST_F(CompareCli, RefusesWhatItCannotCompare) {
  const auto fails = [this](const Arguments& arguments, int code, const std::string& words) {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, code) << words << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, words)) << outcome.err;
  };
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "a"}).code, 0);
  fails({"compare"}, 2, "the argument CONFIG | DIR is missing");
  fails({"compare", "a", "config.yaml"}, 2, "'config.yaml' is not a folder");
  fails({"compare", "a", "--runs", "3"}, 2, "finished runs do not support this option");
  fails({"compare", "a", "--reference", "bath"}, 2,
        "no estimator has the name 'bath'; expected one of ekf");
  fails({"compare", "config.yaml", "--reference", "turth"}, 2, "did you mean 'truth'");
  fails({"compare", "a", "./a/"}, 2,
        "./a/: this folder is given twice; expected folders of different runs");
  fails({"compare", "a", "--filter", "rts"}, 2,
        "no estimator has the name 'rts'; expected one of ekf");
  fails({"compare", "nowhere"}, 66, "nowhere");
  fails({"compare", "."}, 66, "run.json: the file cannot be read");
  fs::create_directory(folder_ / "swept");
  Write("swept/sweep.json", "{}");
  fails({"compare", "swept"}, 65, "swept: this is the folder of a sweep; expected folders that");
  fs::create_directory(folder_ / "run.partial");
  Write("run.partial/run.json", "{\"status\": \"running\"}");
  fails({"compare", "run.partial"}, 65, "run.partial: the run is not finished; expected a ");
  fails({"compare", "config.yaml", "-o", "a"}, 73, "exists already");
  fails({"compare", "config.yaml", "--first-seed", "3"}, 2, "--first-seed requires --runs");
  fails({"compare", "config.yaml", "--jobs", "3"}, 2, "--jobs requires --runs");
  for (const char* budget : {"0", "-3", "abc", "nan", "1e308"}) {
    fails({"compare", "config.yaml", "--budget", budget}, 2,
          "--budget: '" + std::string(budget) + "' is not a number from 1e-09 to 1e+09");
  }
  fails({"compare", "a", "--budget", "3"}, 2, "finished runs do not support this option");
  fails({"compare", "config.yaml", "--runs", "2", "--seed", "7", "--first-seed", "20"}, 2,
        "--first-seed");
  fails({"compare", "a", "--json", "--markdown"}, 2, "--json");
  fails({"compare", "a", "--latex", "--json"}, 2, "--json");
  fails({"compare", "a", "--latex", "--markdown"}, 2, "--markdown");
  fails({"compare", "a", "-o", "a", "--force"}, 73,
        "a: the folder is the input 'a'; expected another folder");
  fails({"compare", "a", "-o", ".", "--force"}, 73, ".: the folder contains the input 'a'");
  EXPECT_TRUE(Exists("a/ekf/estimates.csv"));
  const std::string whole = Read("a/ekf/estimates.csv");
  const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
  Write("a/ekf/estimates.csv", whole.substr(0, last));
  fails({"compare", "a"}, 65,
        "estimates.csv: the file has 151 rows, but run.json records 152 rows; expected an");
  Write("a/ekf/estimates.csv", whole.substr(0, whole.size() - 1));
  fails({"compare", "a"}, 65, "estimates.csv:153: the last line is incomplete");
  for (const auto& [stamp, words] : {std::pair("", "t_s '' is not a number"),
                                     {"nan", "t_s 'nan' is not finite"},
                                     {"1e300", "t_s '1e300' is out of range"},
                                     {"123456789012345678901234567890", "is out of range"},
                                     {"0x1", "not a number"}}) {
    Write("a/ekf/estimates.csv",
          whole.substr(0, last) + stamp + whole.substr(whole.find(',', last)));
    fails({"compare", "a"}, 65, words);
  }
  Write("a/ekf/estimates.csv", whole);
  for (const char* name : {"run.json", "timing.json", "ekf/estimates.csv", "ekf/covariance.bin"}) {
    const bool there = Exists(std::string("a/") + name);
    const std::string kept = there ? Read(std::string("a/") + name) : "";
    fs::remove(folder_ / "a" / name);
    fs::create_directory(folder_ / "a" / name);
    fails({"compare", "a"}, 65, std::string(name) + ": this is not a regular file");
    fs::remove(folder_ / "a" / name);
    ASSERT_EQ(::mkfifo((folder_ / "a" / name).c_str(), 0600), 0);
    fails({"compare", "a"}, 65, std::string(name) + ": this is not a regular file");
    fs::remove(folder_ / "a" / name);
    if (there) Write(std::string("a/") + name, kept);
  }
  const std::string json = Read("a/run.json");
  const auto with = [&](const char* text, const char* other) {
    Write("a/run.json", std::regex_replace(json, std::regex(text), other));
  };
  with("\"data\"", "\"date\"");
  fails({"compare", "a"}, 65, "the hashes of the data are missing");
  with("\"frames\": 152", "\"frames\": \"many\"");
  fails({"compare", "a"}, 65, "a/run.json frames: \"many\"; expected a whole number from 0 to");
  with("\"rows\": 152", "\"rows\": -152");
  fails({"compare", "a"}, 65, "a/run.json estimators.ekf.rows: -152; expected a whole number");
  with("\"smoothed\"", "\"smooth\"");
  fails({"compare", "a"}, 65, "a/run.json estimators.ekf: the key 'smoothed' is missing");
  Write("a/run.json", "{\n  \"status\": ");
  fails({"compare", "a"}, 65, "a/run.json:2:13: ");
}

}  // namespace
}  // namespace alidade
