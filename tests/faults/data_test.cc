// SPDX-License-Identifier: Apache-2.0
//
// Tests the whole program with faulty data. The comment above each test contains the number of the
// fault. The tests of the file readers are in tests/plugins/*/*_faults_test.cc.
#include <cmath>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

/// The camera is at rest at the origin or moves along x. Landmarks are in front of the camera.
constexpr const char* kMapConfig = R"(alidade: 1
camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
state:
  cam:
    model: quaternion_pose
    noise: {kind: discrete, linear_acceleration: 0.3, angular_acceleration: 0.05}
    initial:
      position: {mean: [0, 0, 0], sigma: 0}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}
      velocity: {mean: [0, 0, 0], sigma: 0.1}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.05}
landmarks: {representation: inverse_depth, prior: {inverse_distance: 0.5, sigma: 0.25}}
sensors:
  pixels: {model: inverse_depth_feature, stream: tracks, sigma_px: 1.0,
           roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}}
source: {type: tracks, path: tracks.csv, rate_hz: 30}
estimators: {ekf: {type: ekf, gate: 0.99}}
)";

class DataFault : public testing::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    Write("map.yaml", kMapConfig);
  }
  /// Runs `config` with the output `out`. Expects the exit code `code`.
  Outcome Run(const std::string& config, testing::Arguments more = {}, int code = 0) {
    testing::Arguments arguments = {"run", config, "--force", "-o", "out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    return outcome;
  }
  double Count(const std::string& name) const {
    const Config run = Json("out/run.json");
    const Node counts = run.root().At("estimators").At("ekf").At("counts");
    const auto count = counts.Find(name);
    return count ? count->Number() : 0.0;
  }
};

std::vector<std::string> Cells(const std::string& table) {
  std::vector<std::string> cells(1);
  for (const char c : table) {
    if (c == ',' || c == '\n') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

/// Expects that two tables have equal cells: the same words, and numbers that differ by at most
/// `tolerance`.
void ExpectNear(const std::string& table, const std::string& expected, double tolerance) {
  const std::vector<std::string> a = Cells(table), b = Cells(expected);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i]) continue;
    EXPECT_NEAR(std::stod(a[i]), std::stod(b[i]), tolerance) << "cell " << i;
  }
}

std::string Row(int frame, int feature, int dim, double value) {
  return std::to_string(frame) + ',' + std::to_string(feature) + ',' + std::to_string(dim) + ',' +
         std::to_string(value) + '\n';
}

/// Returns the rows of features 0 to 5, which lie on a plane 4 m ahead. The camera is at `x`.
std::string Plane(int frame, double x) {
  std::string rows;
  for (int i = 0; i < 6; ++i) {
    rows += Row(frame, i, 0, 320 + 525 * (-1.0 + 0.4 * i - x) / 4.0);
    rows += Row(frame, i, 1, 240 + 525 * (i % 2 - 0.5) / 4.0);
  }
  return rows;
}

// Tests fault 39 of tests/faults/README.md.
TEST_F(DataFault, AnIdUsedAgainIsTheNextGeneration) {
  // The track of feature 7 ends with frame 2. In frame 33 another point has the same id.
  std::string rows;
  for (int frame = 0; frame < 40; ++frame) {
    rows += Plane(frame, 0.02 * frame);
    if (frame < 3) rows += Row(frame, 7, 0, 100) + Row(frame, 7, 1, 100);
    if (frame >= 33) rows += Row(frame, 7, 0, 500) + Row(frame, 7, 1, 300);
  }
  Write("tracks.csv", rows);
  Run("map.yaml", {"--set", "landmarks.prune.max_missed_frames=5"});
  const std::string map = Read("out/ekf/landmarks.csv");
  EXPECT_TRUE(Contains(map, "\n7,1,inverse_depth,")) << map;
  EXPECT_TRUE(Contains(map, "\n0,0,inverse_depth,")) << map;
  EXPECT_EQ(Count("landmarks.deleted"), 1);
}

// Tests fault 40 of tests/faults/README.md.
TEST_F(DataFault, WithoutParallaxLandmarksStayInverseDepth) {
  // The camera moves in the same way in both runs. In the second run the landmarks do not move in
  // the image, as if they were at infinity.
  for (const bool moves : {true, false}) {
    std::string rows;
    for (int frame = 0; frame < 60; ++frame) rows += Plane(frame, moves ? 0.03 * frame : 0.0);
    Write("tracks.csv", rows);
    Run("map.yaml",
        {"--set", "landmarks.convert_to_xyz={max_linearity_index: 0.1}", "--set",
         "state.cam.initial.velocity={mean: [0.9, 0, 0], sigma: 0}", "--set",
         "estimators.ekf.gate=none", "--set", "state.cam.noise.linear_acceleration=0.01"});
    EXPECT_EQ(Contains(Read("out/ekf/landmarks.csv"), ",xyz,"), moves);
    EXPECT_EQ(Count("landmarks.converted") > 0, moves);
  }
}

// Tests fault 41 of tests/faults/README.md: a landmark behind the camera, and depths and
// disparities that are not positive.
TEST_F(DataFault, WhatIsNotBeforeTheCameraIsRejectedAndCounted) {
  Write("table.csv", "t_s,d\n0,80\n0.1,0\n0.2,-5\n0.3,82\n");
  Run("table.yaml");
  EXPECT_EQ(Count("invalid:stereo"), 2);
  EXPECT_EQ(Count("accepted:stereo"), 2);
  EXPECT_TRUE(
      Contains(Read("out/ekf/innovations.csv"), "\n0.200000000,disparity,stereo,,invalid,1,,,-5,"))
      << Read("out/ekf/innovations.csv");
  std::string rows;
  for (int frame = 0; frame < 4; ++frame) rows += Row(frame, 9, 0, 320) + Row(frame, 9, 1, 240);
  Write("tracks.csv", rows);
  Run("map.yaml", {"--set", "landmarks.known=[{id: 9, position: [0, 0, -2], sigma: 0}]"});
  EXPECT_EQ(Count("out_of_domain:pixels"), 4);
  // The depth (dim 2) of the last frame is not positive.
  rows.clear();
  for (int frame = 0; frame < 4; ++frame) {
    rows += Row(frame, 9, 0, 320) + Row(frame, 9, 1, 240) + Row(frame, 9, 2, frame < 3 ? 2.0 : 0.0);
  }
  Write("tracks.csv", rows);
  Run("map.yaml", {"--set", "sensors.pixels.model=depth_feature", "--set",
                   "sensors.pixels.sigma_depth_m=0.02", "--set", "source.measures=depth"});
  EXPECT_EQ(Count("accepted:pixels"), 2);
  EXPECT_EQ(Count("invalid:pixels"), 1);
}

// Tests fault 42 of tests/faults/README.md.
TEST_F(DataFault, AnEmptyFrameIsPredictedThrough) {
  Write("table.csv", "t_s,d\n0,80\n0.1,\n0.2,80\n");
  Run("table.yaml");
  const std::string estimates = Read("out/ekf/estimates.csv");
  EXPECT_TRUE(Contains(estimates, "\n0.100000000,")) << estimates;
  EXPECT_EQ(Count("accepted:stereo"), 2);
  Write("tracks.csv", Plane(0, 0.0) + Plane(2, 0.0));
  Write("timestamps.csv", "0,0\n1,0.033\n2,0.066\n");
  Run("map.yaml", {"--set", "source.rate_hz=0"});
  EXPECT_TRUE(Contains(Read("out/ekf/estimates.csv"), "\n0.033000000,"));
  EXPECT_EQ(Count("accepted:pixels"), 6);
}

// Tests faults 27 and 43 of tests/faults/README.md: an error in a data file ends the run with exit
// code 65, and the message names the file and the line.
TEST_F(DataFault, WhatIsNoDataIsExitCode65WithThePlace) {
  for (const char* config : {"table.yaml", "map.yaml"}) {
    const std::string file = config[0] == 't' ? "table.csv" : "tracks.csv";
    Write(file, "");
    const Outcome nothing = Run(config, {}, 65);
    EXPECT_TRUE(Contains(nothing.err, "error: " + file + ": the ") ||
                Contains(nothing.err, '/' + file + ": the "))
        << nothing.err;
    Write(file, "t_s,d\n0,80\n0.1\n");
    const Outcome columns = Run(config, {}, 65);
    EXPECT_TRUE(Contains(columns.err, file + (config[0] == 't' ? ":3:4: the line has 1 column"
                                                               : ":1:6: the row has 2 columns")))
        << columns.err;
  }
}

// The error is the last text on the terminal, and shows the line of the file.
TEST_F(DataFault, AnErrorFollowsTheTableAndShowsTheLine) {
  Write("table.csv", "t_s,d\n0,80\n0.1,abc\n0.2,81\n");
  before_ = "exec 1>both 2>&1";
  EXPECT_EQ(Call({"run", "table.yaml", "-o", "out"}).code, 65);
  const std::string both = Read("both");
  EXPECT_TRUE(Contains(both, "\nreport   out/report.html\n")) << both;
  EXPECT_TRUE(both.ends_with(
      "table.csv:3:5 d: 'abc' is not a number; expected a finite number, or 'missing: "
      "[abc]'\n  3 | 0.1,abc\n    |     ^\n"))
      << both;
}

TEST_F(DataFault, ATableWithoutRowsLeavesNoRunFolder) {
  Write("table.csv", "t_s,d\n");
  const Outcome outcome = Run("table.yaml", {}, 65);
  EXPECT_EQ(outcome.out, "");
  EXPECT_TRUE(Contains(outcome.err, "the table has no rows; expected a row below the header"));
  EXPECT_FALSE(Exists("out"));
  EXPECT_FALSE(Exists("out.partial"));
}

TEST_F(DataFault, ATableWithoutAHeaderIsRecognised) {
  Write("table.csv", "0.000,80\n0.1,81\n");
  const Outcome outcome = Run("table.yaml", {}, 78);
  EXPECT_TRUE(Contains(outcome.err, "because its first line contains numbers, not names"))
      << outcome.err;
}

TEST_F(DataFault, AMissingTextIsAddedToTheEmptyCell) {
  Write("table.csv", "t_s,d\n0,80\n0.1,\n0.2,NA\n");
  const Outcome outcome = Run("table.yaml", {}, 65);
  EXPECT_TRUE(Contains(outcome.err,
                       "table.csv:4:5 d: 'NA' is not a number; expected a finite "
                       "number, or 'missing: [NA]'"))
      << outcome.err;
  Run("table.yaml", {"--set", "source.missing=NA"});
}

// Tests fault 45 of tests/faults/README.md.
TEST_F(DataFault, APixelOutsideTheImageIsRejectedAndCounted) {
  // The image reaches from -0.5 px to 639.5 px in u and from -0.5 px to 479.5 px in v.
  const std::vector<std::pair<double, double>> outside = {
      {-0.6, 100}, {639.6, 100}, {100, -0.6}, {100, 479.6}, {1e9, -1e9}};
  std::string rows;
  for (int frame = 0; frame < 3; ++frame) {
    rows += Plane(frame, 0.0) + Row(frame, 20, 0, 639.5) + Row(frame, 20, 1, -0.5);
    for (std::size_t i = 0; i < outside.size(); ++i) {
      const int id = 10 + static_cast<int>(i);
      rows += Row(frame, id, 0, outside[i].first) + Row(frame, id, 1, outside[i].second);
    }
  }
  Write("tracks.csv", rows);
  Run("map.yaml");
  EXPECT_EQ(Count("invalid:pixels"), 15);
  EXPECT_EQ(Count("initialised:pixels"), 7);
  EXPECT_EQ(Count("accepted:pixels"), 14);
  EXPECT_TRUE(Contains(Read("out/ekf/innovations.csv"), ",tracks,pixels,10,invalid,2,,,-0.6,100,"))
      << Read("out/ekf/innovations.csv");
  const std::string map = Read("out/ekf/landmarks.csv");
  EXPECT_TRUE(Contains(map, "\n20,"));
  EXPECT_FALSE(Contains(map, "\n10,"));
}

// Tests fault 46 of tests/faults/README.md.
TEST_F(DataFault, AnotherUnitIsAWarning) {
  // The disparities belong to a target at 0.325 m. They are first in px, as in the config, and then
  // in a unit that makes them 1000 times larger.
  const auto table = [](double unit) {
    std::string rows = "t_s,d\n";
    for (int k = 0; k < 15; ++k) {
      rows += std::to_string(0.1 * k) + ',' + std::to_string(80.0 * unit) + '\n';
    }
    return rows;
  };
  const std::string warning =
      "unit  ekf: sensor 'stereo': most measurements z and their predictions h differ by more "
      "than 100 sigma; is stream 'disparity' in px?";
  const testing::Arguments gated = {"--set", "estimators.ekf.gate=0.999", "--set",
                                    "state.target.initial.depth={mean: 0.3, sigma: 0.01}"};
  Write("table.csv", table(1.0));
  EXPECT_FALSE(Contains(Run("table.yaml", gated).out, "unit  ekf"));
  Write("table.csv", table(1000.0));
  const Outcome slipped = Run("table.yaml", gated);
  EXPECT_TRUE(Contains(slipped.out, warning)) << slipped.out;
  EXPECT_TRUE(Contains(Read("out/ekf/events.csv"), ",unit,"));
}

// Tests fault 48 of tests/faults/README.md.
TEST_F(DataFault, AFileThatChangesWhileItIsReadIsExitCode74) {
  std::string rows = "t_s,d\n", tracks;
  for (int k = 0; k < 200'000; ++k) rows += std::to_string(0.001 * k) + ",80\n";
  for (int frame = 0; frame < 30'000; ++frame) tracks += Plane(frame, 0.0);
  for (const char* config : {"table.yaml", "map.yaml"}) {
    const std::string file = config[0] == 't' ? "table.csv" : "tracks.csv";
    Write(file, config[0] == 't' ? rows : tracks);
    const pid_t run = Start({"run", config, "--force", "-o", "out"});
    EXPECT_TRUE(Eventually([&] { return Exists("out.partial/ekf/estimates.csv"); }));
    std::ofstream(folder_ / file, std::ios::app) << "# one more\n";
    const Outcome outcome = Wait(run);
    EXPECT_EQ(outcome.code, 74) << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, ": the file changed while it was read")) << outcome.err;
    EXPECT_EQ(Json("out/run.json").root().At("status").Text(), "failed");
  }
}

/// Returns the truth of 20 frames with rotations about y from 0 to 3.8 rad. If `turned` is true,
/// every third quaternion is negated. Otherwise all other quaternions are negated.
std::string Turning(bool turned, double length = 1.0) {
  std::ostringstream rows;
  rows.precision(17);
  for (int k = 0; k < 20; ++k) {
    const double sign = ((k % 3 == 0) == turned ? -1.0 : 1.0) * length;
    rows << k / 30.0 << " 0 0 0 0 " << sign * std::sin(0.1 * k) << " 0 " << sign * std::cos(0.1 * k)
         << '\n';
  }
  return rows.str();
}

// Tests fault 49 of tests/faults/README.md.
TEST_F(DataFault, TheSignOfAQuaternionIsNotSeen) {
  std::string rows;
  for (int frame = 0; frame < 20; ++frame) rows += Plane(frame, 0.0);
  Write("tracks.csv", rows);
  std::vector<std::string> files;
  for (const bool turned : {false, true}) {
    Write("truth.tum", Turning(turned));
    Run("map.yaml",
        {"--set", std::string("state.cam.initial.orientation={mean: ") +
                      (turned ? "{w: 0, x: 0, y: -1, z: 0}" : "{w: 0, x: 0, y: 1, z: 0}") +
                      ", sigma: 0}"});
    for (const char* file : {"ekf/estimates.csv", "ekf/innovations.csv", "truth.csv"}) {
      files.push_back(Read(std::string("out/") + file));
    }
    files.push_back(std::string(Json("out/run.json")
                                    .root()
                                    .At("estimators")
                                    .At("ekf")
                                    .At("metrics")
                                    .At("rmse:cam.orientation")
                                    .Text()));
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(files[i], files[i + 4]);
  // The signs are chosen so that the quaternion is continuous: at the last rotation, 3.8 rad, w is
  // negative.
  EXPECT_TRUE(Contains(files[2], ",0,0,0,-0.3")) << files[2];
}

// Tests fault 49 of tests/faults/README.md.
TEST_F(DataFault, QuaternionsOfAnotherLengthAreNormalisedAndCounted) {
  std::string rows;
  for (int frame = 0; frame < 20; ++frame) rows += Plane(frame, 0.0);
  Write("tracks.csv", rows);
  Write("truth.tum", Turning(false));
  Run("map.yaml");
  EXPECT_FALSE(Json("out/run.json").root().Find("normalised"));
  const std::string truth = Read("out/truth.csv");
  Write("truth.tum", Turning(false, 1.0009));
  Run("map.yaml");
  const Config run = Json("out/run.json");
  EXPECT_EQ(run.root().At("normalised").At("cam.orientation").Number(), 20);
  // The elements are at most 1, and their difference is a few rounding errors.
  ExpectNear(Read("out/truth.csv"), truth, 1e-12);
  Write("truth.tum", Turning(false, 1.0011));
  const Outcome tum = Run("map.yaml", {}, 65);
  EXPECT_TRUE(Contains(tum.err, "truth.tum:1: the length of the quaternion is 1.0011")) << tum.err;
  // Here the quaternion is read from the columns of a table.
  const testing::Arguments columns = {"--set",
                                      "source={type: tables, path: turn.csv, streams: {tracks: [w, "
                                      "x]}, truth: {orientation: [w, x, y, z]}}"};
  Write("turn.csv", "t_s,w,x,y,z\n0,1,0,0,0\n0.1,0.6,0.8,0,0\n0.2,0.6,0.8,0.0003,0.04\n");
  Run("map.yaml", columns);
  EXPECT_EQ(Json("out/run.json").root().At("normalised").At("orientation").Number(), 1);
  EXPECT_EQ(Count("invalid:pixels"), 3)
      << "a measurement of pixels without a landmark id is invalid";
  Write("turn.csv", "t_s,w,x,y,z\n0,1,0,0,0\n0.1,0.6,0.8,0.1,0\n");
  const Outcome table = Run("map.yaml", columns, 65);
  EXPECT_TRUE(Contains(table.err,
                       "turn.csv:3 orientation: the length of a unit quaternion differs from 1 by "
                       "0.004988; expected a length within 1e-3 of 1"))
      << table.err;
}

TEST_F(DataFault, ATruthThatNoFrameHasIsTold) {
  Write("tracks.csv", Plane(0, 0.0) + Plane(1, 0.0));
  Write("truth.tum", "1000 0 0 0 0 0 0 1\n");
  const Outcome run = Run("map.yaml");
  EXPECT_TRUE(Contains(run.out,
                       "no frame contains the truth of cam.position, cam.orientation; do the times "
                       "of the truth match those of the measurements?"))
      << run.out;
  Write("truth.tum", "0 0 0 0 0 0 0 1\n");
  EXPECT_FALSE(Contains(Run("map.yaml").out, "no frame contains the truth"));
}

// The choice between q and -q depends on the order of the timestamps, not on the order of arrival.
TEST_F(DataFault, SignsOfATruthDoNotDependOnTheOrderOfArrival) {
  Write("tracks.csv", Plane(0, 0.0));
  const testing::Arguments sorted = {
      "--set",
      "source={type: tables, path: turn.csv, streams: {tracks: [w, x]}, truth: {orientation: [w, "
      "x, y, z]}}",
      "--set", "out_of_sequence={policy: buffer, window_s: 1}"};
  const std::string header = "t_s,w,x,y,z\n", first = "0,0.6,0.8,0,0\n",
                    last = "0.1,-0.6,0.8,0,0\n";
  Write("turn.csv", header + first + last);
  Run("map.yaml", sorted);
  const std::string truth = Read("out/truth.csv");
  Write("turn.csv", header + last + first);
  Run("map.yaml", sorted);
  EXPECT_EQ(Read("out/truth.csv"), truth);
}

// Tests fault 78 of tests/faults/README.md.
TEST_F(DataFault, ScaleThatNobodyTellsIsReportedAndNoFailure) {
  Write("tracks.csv", Plane(0, 0.0) + Plane(1, 0.01) + Plane(2, 0.02));
  const Outcome alone = Call({"explain", "map.yaml"});
  EXPECT_TRUE(Contains(
      alone.out, "  unobservable: scale (1 direction)\n  the prior alone determines the scale"))
      << alone.out;
  const Outcome at_infinity =
      Call({"explain", "map.yaml", "--set", "landmarks.prior.inverse_distance=0"});
  EXPECT_TRUE(Contains(at_infinity.out, "  unobservable: scale (1 direction)\n"))
      << at_infinity.out;
  const Outcome run = Run("map.yaml");
  EXPECT_TRUE(
      Contains(run.out, "unobservable  ekf: no sensor of this estimator determines scale\n"))
      << run.out;
  EXPECT_TRUE(Contains(Read("out/run.json"), "\"scale\"")) << Read("out/run.json");
  const char* const observed = "the state is fully observable";
  // Measured depths make the scale observable. Landmarks with known positions also make the scale
  // observable.
  const Outcome depth =
      Call({"explain", "map.yaml", "--set", "sensors.pixels.model=depth_feature", "--set",
            "sensors.pixels.sigma_depth_m=0.02", "--set", "source.measures=depth"});
  EXPECT_TRUE(Contains(depth.out, observed)) << depth.out << depth.err;
  const Outcome known = Call({"explain", "map.yaml", "--set",
                              "landmarks.known=[{id: 1, position: [0, 0, 2], sigma: 0.01}]"});
  EXPECT_TRUE(Contains(known.out, observed)) << known.out << known.err;
}

}  // namespace
}  // namespace alidade
