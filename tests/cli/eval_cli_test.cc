// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "alidade/config/config.h"
#include "alidade/evaluate/trajectory.h"
#include "support/program.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::Arguments;
using testing::Contains;
using testing::Outcome;
using Cli = testing::ProgramTest;

/// Returns poses on a half circle of radius `radius`, one pose every 0.1 s, beginning at `t0`.
std::string HalfCircle(double radius, double t0 = 0.0) {
  std::string text = "# t x y z qx qy qz qw\n";
  for (int i = 0; i <= 30; ++i) {
    const double angle = 0.1 * i;
    for (const double value : {t0 + angle, radius * std::cos(angle), radius * std::sin(angle),
                               0.1 * std::sin(3 * angle), 0.0, 0.0, std::sin(0.5 * angle)}) {
      text += std::to_string(value) + ' ';
    }
    text += std::to_string(std::cos(0.5 * angle)) + '\n';
  }
  return text;
}

class EvalCli : public Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    Write("truth.tum", HalfCircle(2.0));
    Write("mono.tum", HalfCircle(1.0));
  }
  Config Evaluated(Arguments arguments) const {
    arguments.insert(arguments.begin(), "eval");
    arguments.emplace_back("--json");
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Config::FromText(outcome.out, "stdout");
  }
};

TEST_F(EvalCli, FlagsOfEvoMeanWhatTheyMeanInEvo) {
  const auto align = [&](const Arguments& options, bool options_first = false) {
    Arguments all = {"truth.tum", "mono.tum"};
    all.insert(options_first ? all.begin() : all.end(), options.begin(), options.end());
    const Config json = Evaluated(all);
    return json.root().At("evaluations").Items().front().At("align").Text();
  };
  EXPECT_EQ(align({}), "none");
  EXPECT_EQ(align({"-a"}), "se3");
  EXPECT_EQ(align({"-s"}), "scale");
  EXPECT_EQ(align({"-as"}), "sim3");
  EXPECT_EQ(align({"--align"}), "se3");
  EXPECT_EQ(align({"--align"}, true), "se3");  // the option is given without a value
  EXPECT_EQ(align({"--align", "--correct_scale"}, true), "sim3");
  EXPECT_EQ(align({"--align_origin"}), "origin");
  EXPECT_EQ(align({"--align-origin"}), "origin");
  for (const char* mode : {"none", "scale", "origin", "yaw", "se3", "sim3"}) {
    EXPECT_EQ(align({"--align-mode", mode}), mode);
    EXPECT_EQ(align({"--align_mode=" + std::string(mode)}), mode);
  }
  for (const Arguments& bad : {Arguments{"--align-mode", "se4"},
                               {"--align-mode", "se3", "-a"},
                               {"-a", "--align_origin"},
                               {"-r", "translation"},
                               {"-u", "km"},
                               {"-d", "0"},
                               {"-d", "1.5"},
                               {"--json", "--latex"},
                               {"--t_max_diff", "-1"},
                               {"--t_start", "2", "--t_end", "1"},
                               {"--project_to_plane", "none"},
                               {"--downsample", "0"}}) {
    Arguments all = {"eval", "truth.tum", "mono.tum"};
    all.insert(all.end(), bad.begin(), bad.end());
    const Outcome outcome = Call(all);
    EXPECT_EQ(outcome.code, 2) << bad.back();
    EXPECT_TRUE(outcome.err.starts_with("error: ")) << outcome.err;
    EXPECT_TRUE(outcome.err.ends_with("\nsee `alidade eval --help`\n")) << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 2) << outcome.err;
  }
  const Outcome alone = Call({"eval", "truth.tum"});
  EXPECT_EQ(alone.code, 2);
  EXPECT_EQ(alone.err,
            "error: truth.tum: a single file cannot be evaluated; expected two files REF EST, or "
            "the folder of a run\nsee `alidade eval --help`\n");
}

TEST_F(EvalCli, EachOptionOfEvoIsTakenWithUnderscoresAndWithHyphens) {
  const Arguments options = {"--pose_relation",
                             "full",
                             "--delta",
                             "2",
                             "--delta_unit",
                             "f",
                             "--all_pairs",
                             "--delta_tol",
                             "0.2",
                             "--t_max_diff",
                             "0.02",
                             "--t_offset",
                             "0.001",
                             "--n_to_align",
                             "20",
                             "--t_start",
                             "0.1",
                             "--t_end",
                             "2.8",
                             "--downsample",
                             "30",
                             "--project_to_plane",
                             "xy",
                             "--align"};
  Arguments hyphens = options;
  for (std::string& option : hyphens) std::ranges::replace(option, '_', '-');
  const auto text = [&](const Arguments& arguments) {
    Arguments all = {"eval", "truth.tum", "mono.tum", "--quiet", "--json"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome outcome = Call(all);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  EXPECT_EQ(text(options), text(hyphens));
  const Config json = Config::FromText(text(hyphens), "stdout");
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("align_poses").Integer(0, 100), 20);
  EXPECT_EQ(one.At("pairs").At("delta").Number(), 2.0);
}

/// The expected values are computed by hand. The reference has the times 0, 1, 2, 3 at x = 0, 1, 2,
/// 3. The estimate has the times 0, 1, 1, 2 at x = 0, 1, 1.5, 2. The pairs of x are (0, 0), (1, 1),
/// (1, 1.5), (2, 2).
///
///   ATE errors 0, 0, 0.5, 0                                         rmse 0.25
///   RPE of steps 1, 0, 1 compared with 1, 0.5, 0.5: 0, 0.5, 0.5     rmse sqrt(0.5 / 3)
TEST_F(EvalCli, BothPosesOfADuplicateTimestampCountAsInEvo) {
  Write("ref.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n3 3 0 0 0 0 0 1\n");
  Write("est.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 1.5 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n");
  const Config json = Evaluated({"ref.tum", "est.tum", "-r", "trans_part"});
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("matched").Integer(0, 9), 4);
  EXPECT_DOUBLE_EQ(one.At("ate").At("trans_part").At("rmse").Number(), 0.25);
  EXPECT_DOUBLE_EQ(one.At("rpe").At("trans_part").At("rmse").Number(), std::sqrt(0.5 / 3.0));
  EXPECT_EQ(Call({"eval", "ref.tum", "est.tum"}).err,
            "warning: est.tum:3 t: 1.000000 s is a duplicate timestamp; expected each timestamp "
            "once; all poses are retained\n");
}

TEST_F(EvalCli, TwoFilesOfKittiGoByTheTimesBesideThem) {
  fs::create_directory(folder_ / "a");
  fs::create_directory(folder_ / "b");
  const auto row = [](double x) { return "1 0 0 " + std::to_string(x) + " 0 1 0 0 0 0 1 0\n"; };
  Write("a/gt.txt", row(0) + row(1) + row(2) + row(3));
  Write("a/times.txt", "0\n0.1\n0.2\n0.3\n");
  Write("b/orb.txt", row(1) + row(3.5));
  Write("b/times.txt", "0.1\n0.3\n");
  const Config json = Evaluated({"a/gt.txt", "b/orb.txt"});
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("matched").Integer(0, 9), 2);
  EXPECT_FALSE(one.At("by_row").Flag());
  EXPECT_DOUBLE_EQ(one.At("ate").At("trans_part").At("max").Number(), 0.5);
}

TEST_F(EvalCli, SwappedFilesAreToldOf) {
  const Outcome swapped = Call({"eval", "mono.tum", "truth.tum", "-as"});
  EXPECT_EQ(swapped.code, 0);
  EXPECT_EQ(swapped.err,
            "warning: truth.tum: the file is named like ground truth, but is used as the estimate; "
            "the reference is mono.tum; expected REF first, then EST\n");
}

TEST_F(EvalCli, WarningsGoToStandardErrorAndFiguresToStandardOutput) {
  const Outcome se3 = Call({"eval", "truth.tum", "mono.tum", "-a"});
  EXPECT_EQ(se3.code, 0);
  EXPECT_TRUE(se3.err.starts_with("warning: mono.tum: the scale is 1.993 (the error is "))
      << se3.err;
  EXPECT_TRUE(Contains(se3.out, "aligned    se3, scale 1.000000\n")) << se3.out;
  EXPECT_EQ(Call({"eval", "truth.tum", "mono.tum", "-a", "--quiet"}).err, "");
  const Outcome sim3 = Call({"eval", "truth.tum", "mono.tum", "-as"});
  EXPECT_EQ(sim3.err, "");
  EXPECT_TRUE(Contains(sim3.out, "matched    31 of 31 possible poses, within 0.01 s\n"));
}

TEST_F(EvalCli, OptionsReachTheEvaluation) {
  Write("late.tum", HalfCircle(2.0, 5.0));
  const Config json =
      Evaluated({"truth.tum", "late.tum", "--t_offset", "-5", "--t_max_diff", "0.02", "-r", "full",
                 "-r", "angle_rad", "-d", "0.5", "-u", "m", "--all_pairs", "-t", "0.2"});
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("matched").Integer(0, 100), 31);
  EXPECT_EQ(one.At("t_offset").Number(), -5.0);
  EXPECT_EQ(one.At("t_max_diff").Number(), 0.02);
  std::vector<std::string> relations;
  for (const auto& [name, errors] : one.At("ate").Entries()) relations.push_back(name);
  EXPECT_EQ(relations, (std::vector<std::string>{"full", "angle_rad"}));
  EXPECT_EQ(one.At("pairs").At("delta").Number(), 0.5);
  EXPECT_EQ(one.At("pairs").At("delta_unit").Text(), "m");
  EXPECT_TRUE(one.At("pairs").At("all_pairs").Flag());
}

TEST_F(EvalCli, ASelectionAndAProjectionAreReportedWithTheFigures) {
  Write("unix.tum", HalfCircle(2.0, 1403636580.0));
  // A double is not exact to the ns at these times, so both ends would be lost.
  const Arguments call = {
      "eval",    "unix.tum",     "unix.tum",     "--t-start", "1403636580.7",
      "--t-end", "1403636581.3", "--downsample", "31",        "--project-to-plane",
      "xy"};
  const Outcome outcome = Call(call);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Contains(outcome.out,
                       "selected   at most 31 of each file, from 1403636580.700000 s, to "
                       "1403636581.300000 s\nmatched    7 of 7 possible poses"))
      << outcome.out;
  EXPECT_TRUE(Contains(outcome.out, "aligned    none, projected to xy, scale")) << outcome.out;
  const Config json = Evaluated({call.begin() + 1, call.end()});
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_NEAR(one.At("t_start").Number(), 1403636580.7, 1e-6);
  EXPECT_NEAR(one.At("t_end").Number(), 1403636581.3, 1e-6);
  EXPECT_EQ(one.At("downsample").Number(), 31.0);
  EXPECT_EQ(one.At("project_to_plane").Text(), "xy");
  Arguments markdown = call;
  markdown.emplace_back("--markdown");
  EXPECT_TRUE(Contains(Call(markdown).out,
                       "; selected poses: at most 31 of each file, from 1403636580.700000 s, to "
                       "1403636581.300000 s."))
      << Call(markdown).out;
}

TEST_F(EvalCli, SkipNanLeavesOutLostFramesOfBothFiles) {
  const std::string pose = " 1 2 3 0 0 0 1\n", lost = " nan nan nan nan nan nan nan\n";
  Write("gt.tum", "0" + pose + "1" + lost + "2" + pose + "3" + pose);
  Write("est.tum", "0" + pose + "1" + pose + "2" + lost + "3" + pose);
  const Outcome outcome = Call({"eval", "gt.tum", "est.tum", "--skip-nan"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Contains(outcome.out, "matched    2 of 3 possible poses")) << outcome.out;
  EXPECT_TRUE(Contains(outcome.err, "gt.tum:2: 1 of 4 rows")) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "est.tum:3: 1 of 4 rows")) << outcome.err;
}

TEST_F(EvalCli, BadInputIsRefusedWithItsPlace) {
  Write("bad.tum", "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 nan 1\n");
  const Outcome bad = Call({"eval", "truth.tum", "bad.tum"});
  EXPECT_EQ(bad.code, 65);
  EXPECT_EQ(bad.err,
            "error: bad.tum:2:13 qz: 'nan' is not finite; expected a finite number, or --skip-nan "
            "to leave out such rows; read as tum (8 columns); the alternative is --format euroc\n"
            "  2 | 1 1 2 3 0 0 nan 1\n"
            "    |             ^\n");
  EXPECT_EQ(Call({"eval", "truth.tum", "missing.tum"}).code, 66);
  EXPECT_EQ(Call({"eval", ".", "mono.tum"}).code, 0);  // uses truth.tum of the folder
  const Outcome none = Call({"eval", "truth.tum", "."});
  EXPECT_EQ(none.code, 66);
  EXPECT_TRUE(none.err.starts_with("error: .: this folder does not contain a trajectory; expected"))
      << none.err;
}

// Tests fault 91 of tests/faults/README.md.
TEST_F(EvalCli, ATornLastRowOfAnUnfinishedRunIsIgnored) {
  const std::string whole = HalfCircle(2.0);
  const std::string torn = whole.substr(0, whole.size() - 5);
  for (const char* folder : {"killed.partial", "copied"}) {
    fs::create_directories(folder_ / folder / "ekf");
    Write(std::string(folder) + "/truth.tum", whole);
    Write(std::string(folder) + "/ekf/trajectory.tum", torn.substr(0, torn.rfind(' ')));
  }
  const Config json = Evaluated({"killed.partial"});
  EXPECT_EQ(json.root().At("evaluations").Items().front().At("matched").Number(), 30);
  EXPECT_EQ(Call({"eval", "copied"}).code, 65)
      << "only the files of an unfinished run may have an incomplete last row";
}

TEST_F(EvalCli, SeveralEstimatesAreOneTable) {
  const Outcome table = Call({"eval", "truth.tum", "truth.tum", "mono.tum", "-a", "--markdown"});
  EXPECT_EQ(table.code, 0);
  EXPECT_TRUE(Contains(table.out, "| truth | se3 | 1.000000 | 31 of 31 | 0.01 | 0.000000 |"))
      << table.out;
  EXPECT_TRUE(Contains(table.out, "| mono | se3 |")) << table.out;
}

TEST_F(EvalCli, WithoutPairsTheOtherFiguresStand) {
  const Outcome outcome = Call({"eval", "truth.tum", "mono.tum", "-as", "-d", "30", "-u", "m"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err,
            "warning: mono.tum --delta: no two of 31 poses are 30 m apart; expected a smaller "
            "--delta, or a larger --delta-tol\n");
  EXPECT_TRUE(Contains(outcome.out, "ATE trans_part [m]")) << outcome.out;
  EXPECT_FALSE(Contains(outcome.out, "RPE")) << outcome.out;
}

TEST_F(EvalCli, AnEstimateThatFailsLeavesTheOthersTheirFigures) {
  Write("two.tum", "0 2 0 0 0 0 0 1\n0.1 2 0.2 0 0 0 0 1\n");
  const Arguments call = {"eval", "truth.tum", "two.tum", "mono.tum", "-a", "--quiet"};
  Arguments markdown = call, json = call;
  markdown.emplace_back("--markdown");
  json.emplace_back("--json");
  const Outcome table = Call(markdown);
  EXPECT_EQ(table.code, 65);
  EXPECT_EQ(table.err,
            "error: two.tum: 2 poses are too few for an alignment; expected 3 or more poses\n");
  EXPECT_TRUE(Contains(table.out, "| two | failed | - | - | - | - | - | - | - |\n")) << table.out;
  EXPECT_TRUE(Contains(table.out, "| mono | se3 | 1.000000 | 31 of 31 |")) << table.out;
  EXPECT_TRUE(
      Contains(table.out, "RMSE, compared with truth.tum; RPE of consecutive pairs, 1 f apart"))
      << table.out;
  EXPECT_TRUE(Contains(Call(call).out, "failed")) << Call(call).out;
  const Outcome both = Call(json);
  EXPECT_EQ(both.code, 65);
  const Config parsed = Config::FromText(both.out, "stdout");
  const Node evaluations = parsed.root().At("evaluations");
  EXPECT_EQ(evaluations.Items()[0].At("estimate").Text(), "two");
  EXPECT_EQ(evaluations.Items()[0].At("error").Text(),
            "two.tum: 2 poses are too few for an alignment; expected 3 or more poses");
  EXPECT_TRUE(evaluations.Items()[1].At("ate").Find("trans_part"));
  EXPECT_FALSE(evaluations.Items()[1].Find("error"));
  // If the only estimate cannot be evaluated, the program prints no table.
  const Outcome alone = Call({"eval", "truth.tum", "two.tum", "-a"});
  EXPECT_EQ(alone.code, 65);
  EXPECT_EQ(alone.out, "");
  EXPECT_EQ(Call({"eval", "truth.tum", "missing.tum", "mono.tum"}).code, 66);
}

TEST_F(EvalCli, WarningsOfTheReferenceAreInJsonToo) {
  Write("unsorted.tum", "0.1 2 0.2 0 0 0 0 1\n0 2 0 0 0 0 0 1\n0.2 2 0.4 0 0 0 0 1\n");
  const Config json = Evaluated({"unsorted.tum", "mono.tum", "--quiet"});
  const Node warnings = json.root().At("evaluations").Items().front().At("warnings");
  ASSERT_FALSE(warnings.Items().empty());
  EXPECT_TRUE(warnings.Items()[0].Text().starts_with("unsorted.tum:2 t: 0.000000 s is earlier"))
      << warnings.Items()[0].Text();
  const Outcome outcome = Call({"eval", "unsorted.tum", "mono.tum"});
  EXPECT_EQ(outcome.err.find("is earlier"), outcome.err.rfind("is earlier")) << outcome.err;
}

TEST_F(EvalCli, AChoiceIsNamedAmongThoseThereAre) {
  for (const char* wrong : {"sim2", "3"}) {
    const Outcome outcome = Call({"eval", "truth.tum", "mono.tum", "--align-mode", wrong});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(outcome.err.starts_with("error: --align-mode: '" + std::string(wrong) +
                                        "' is not one of none, scale, origin, yaw, se3, sim3\n"))
        << outcome.err;
  }
  for (const char* mode : {"none", "origin"}) {
    const Outcome first =
        Call({"eval", "truth.tum", "mono.tum", "--n-to-align", "10", "--align-mode", mode});
    EXPECT_EQ(first.code, 2) << mode;
    EXPECT_TRUE(first.err.starts_with("error: --n-to-align: alignment '" + std::string(mode) + "'"))
        << first.err;
  }
}

TEST_F(EvalCli, OfARunSaysWhatTheRunSaid) {
  const std::string example = ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml";
  ASSERT_EQ(Call({"run", example, "-o", "slam", "--quiet"}).code, 0);
  const Config run = Json("slam/run.json");
  const Node metrics = run.root().At("estimators").At("ekf").At("metrics");
  const Config json = Evaluated({"slam", "slam", "-r", "trans_part", "-r", "angle_rad"});
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("estimate").Text(), "ekf");
  EXPECT_EQ(one.At("matched").Integer(0, 1000), 150);
  const double position = one.At("ate").At("trans_part").At("rmse").Number();
  EXPECT_NEAR(position, metrics.At("rmse:cam.position").Number(), 1e-12);
  EXPECT_NEAR(one.At("ate").At("angle_rad").At("rmse").Number(),
              metrics.At("rmse:cam.orientation").Number(), 1e-9);
  EXPECT_NEAR(one.At("nis").At("pixels").At("mean").Number(),
              metrics.At("nis.mean:pixels").Number(), 1e-12);
  // The first pose is known exactly, so no NEES is computed for it.
  EXPECT_EQ(one.At("nees_position").At("poses").Integer(0, 1000), 149);
  EXPECT_TRUE(one.At("nees_orientation").Find("mean"));
  // If only one run is given, it is compared with its own truth.
  const auto text = [&](const Arguments& arguments) {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  EXPECT_EQ(text({"eval", "slam"}), text({"eval", "slam", "slam"}));
  EXPECT_EQ(text({"eval", "slam/ekf"}), text({"eval", "slam/truth.tum", "slam/ekf"}));
  const Config twice = Evaluated({"slam", "slam", "./slam/ekf"});
  EXPECT_EQ(twice.root().At("evaluations").Items()[0].At("estimate").Text(),
            "slam/ekf/trajectory_covariance");
  const Outcome aligned = Call({"eval", "slam", "slam/ekf", "-as"});
  EXPECT_TRUE(Contains(aligned.out, "NEES withheld: the alignment by sim3 ")) << aligned.out;
}

/// A robot moves in the plane. The position fixes have a known standard deviation.
const std::string kPlanarConfig = R"(alidade: 1
state:
  robot: {model: planar, input: {stream: odometry}, noise: {speed: 0.05, turn_rate: 0.05},
          initial: {position: {mean: [0, 0], sigma: 0.2}, heading: {mean: 0.1, sigma: 0.2}}}
sensors:
  gps: {model: planar_fix, stream: gps, roles: {position: robot.position}, sigma_m: 0.3}
source:
  type: tables
  path: drive.csv
  streams: {gps: [gx, gy], odometry: [v, o]}
  truth: {robot.position: [tx, ty], robot.heading: th}
estimators: {ekf: {type: ekf}}
)";

/// Returns a table of a drive at 1 m/s on a circle of radius 5 m. The drive covers more than one
/// full circle.
std::string PlanarDrive() {
  std::string text = "t_s,v,o,gx,gy,tx,ty,th\n";
  for (int i = 0; i <= 400; ++i) {
    const double t = 0.1 * i, heading = 0.2 * t;
    const double x = 5.0 * std::sin(heading), y = 5.0 - 5.0 * std::cos(heading);
    for (const double value :
         {t, 1.0, 0.2, x + 0.3 * std::sin(7.0 * i), y + 0.3 * std::cos(9.0 * i), x, y}) {
      text += std::to_string(value) + ',';
    }
    text += std::to_string(std::remainder(heading, 2.0 * std::acos(-1.0))) + '\n';
  }
  return text;
}

TEST_F(EvalCli, ARobotInThePlaneHasATrajectory) {
  Write("planar.yaml", kPlanarConfig);
  Write("drive.csv", PlanarDrive());
  const std::string plugin = ALIDADE_BINARY_DIR "/tests/plugins/planar.so";
  const Outcome run =
      Call({"run", "planar.yaml", "-o", "planar", "--plugin-path", plugin, "--quiet"});
  ASSERT_EQ(run.code, 0) << run.err;
  const Config json = Evaluated({"planar", "-r", "trans_part", "-r", "angle_rad"});
  const Node one = json.root().At("evaluations").Items().front();
  EXPECT_EQ(one.At("matched").Integer(0, 1000), 401);
  EXPECT_TRUE(one.At("warnings").Items().empty()) << one.At("warnings").Items()[0].Text();
  const Config record = Json("planar/run.json");
  const Node metrics = record.root().At("estimators").At("ekf").At("metrics");
  EXPECT_NEAR(one.At("ate").At("trans_part").At("rmse").Number(),
              metrics.At("rmse:robot.position").Number(), 1e-12);
  EXPECT_NEAR(one.At("ate").At("angle_rad").At("rmse").Number(),
              metrics.At("rmse:robot.heading").Number(), 1e-9);
  EXPECT_TRUE(one.At("nis").Find("gps"));

  // Calculates the NEES from the files and compares it with the output.
  const Trajectory truth = ReadTrajectory(folder_ / "planar/truth.tum");
  const Trajectory ekf = ReadTrajectory(folder_ / "planar/ekf/trajectory_covariance.tum");
  ASSERT_EQ(truth.size(), ekf.size());
  double position = 0.0, heading = 0.0;
  for (int i = 0; i < ekf.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(ekf.positions(2, i), 0.0);
    const Eigen::Vector2d e = (truth.positions.col(i) - ekf.positions.col(i)).head<2>();
    const Eigen::Matrix2d p = ekf.position_covariances[at].topLeftCorner<2, 2>();
    position += e.dot(p.inverse() * e) / 2.0;
    const Eigen::Quaterniond turn = ekf.orientations[at].conjugate() * truth.orientations[at];
    heading +=
        std::pow(2.0 * std::atan(turn.z() / turn.w()), 2) / ekf.orientation_covariances[at](2, 2);
  }
  EXPECT_EQ(one.At("nees_position").At("dof").Integer(0, 3), 2);
  EXPECT_NEAR(one.At("nees_position").At("mean").Number(), position / ekf.size(), 1e-9);
  EXPECT_EQ(one.At("nees_orientation").At("dof").Integer(0, 3), 1);
  EXPECT_NEAR(one.At("nees_orientation").At("mean").Number(), heading / ekf.size(), 1e-9);
  EXPECT_TRUE(Contains(Call({"eval", "planar"}).out, "NEES position (2 dof) "));

  // The output of `simulate` also contains the true poses.
  ASSERT_EQ(Call({"simulate", "planar.yaml", "-o", "data"}).code, 0);
  EXPECT_EQ(Read("data/truth.tum"), Read("planar/truth.tum"));
}

}  // namespace
}  // namespace alidade
