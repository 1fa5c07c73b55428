// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include "support/bal_formula.h"
#include "support/bundles.h"
#include "support/colmap_formula.h"
#include "support/program.h"

namespace alidade {
namespace {

using testing::Arguments;
using testing::Contains;
using testing::Outcome;

class BundleCli : public testing::ProgramTest {};

TEST_F(BundleCli, AdjustsAndWritesTheSameFormat) {
  BundleFile file = testing::TrueBundle();
  testing::Disturb(file.problem);
  Write("p.txt", BundleText(file));
  const Outcome made = Call({"bundle", "p.txt", "-o", "out"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(Contains(made.out, "bal: 6 cameras, 40 points, ")) << made.out;
  EXPECT_TRUE(Contains(made.out, " converged after ")) << made.out;
  EXPECT_TRUE(
      Contains(made.out, "gauge: the pose of the first camera and the scale are constant\n"))
      << made.out;
  EXPECT_TRUE(Contains(made.out, "\nreport   out/report.html\n")) << made.out;
  const Outcome again = Call({"bundle", "out/problem.txt"});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_LT(Json("out/bundle.json").root().At("rms_after_px").Number(), 1e-8);
  EXPECT_EQ(Call({"bundle", "p.txt", "-o", "out"}).code, 73);
  EXPECT_EQ(Call({"bundle", "none.txt", "-o", "out"}).code, 73)
      << "an existing output is refused before the input is read";
  EXPECT_EQ(Call({"bundle", "p.txt", "-o", "out", "--force", "--quiet"}).out, "");
}

TEST_F(BundleCli, AdjustsColmapFolders) {
  for (const auto& [model, parameters] : std::map<std::string, std::vector<double>>{
           {"SIMPLE_PINHOLE", {700, 500, 400}},
           {"PINHOLE", {700, 710, 500, 400}},
           {"SIMPLE_RADIAL", {700, 500, 400, -0.1}},
           {"RADIAL", {700, 500, 400, -0.1, 0.02}},
           {"OPENCV", {700, 710, 500, 400, -0.1, 0.02, 0.001, -0.002}}}) {
    testing::WriteColmap(folder_ / "sparse", model, parameters, 0.05);
    const double before = testing::ColmapRms(folder_ / "sparse");
    EXPECT_GT(before, 1.0);
    const Outcome made = Call({"bundle", "sparse", "-o", "out", "--force"});
    EXPECT_EQ(made.code, 0) << model << made.err;
    EXPECT_TRUE(Contains(made.out, "colmap: 6 cameras, 30 points, 180 observations\n")) << made.out;
    EXPECT_NEAR(Json("out/bundle.json").root().At("rms_before_px").Number(), before, 1e-9);
    EXPECT_LT(testing::ColmapRms(folder_ / "out/problem"), 1e-6) << model;
    std::istringstream camera(Read("out/problem/cameras.txt"));
    std::string line, word;
    std::getline(std::getline(camera, line), line);
    std::istringstream row(line);
    row >> word >> word >> word >> word;
    EXPECT_TRUE(line.starts_with("7 " + model + " 1000 800 ")) << line;
    for (const double expected : parameters) {
      double value = 0.0;
      row >> value;
      EXPECT_NEAR(value, expected, 1e-4 * std::abs(expected) + 1e-5) << model << ": " << line;
    }
    EXPECT_FALSE(row >> word) << line;
    EXPECT_TRUE(Contains(Read("out/problem/images.txt"), " 7 image 3.jpg\n1.5 2.5 -1 "));
  }
}

TEST_F(BundleCli, APoseGraphIsNotABundleAdjustmentProblem) {
  Write("graph.g2o", "VERTEX_SE3:QUAT 4 1 2 3 0 0 0 1\n");
  const Outcome made = Call({"bundle", "graph.g2o"});
  EXPECT_EQ(made.code, 65);
  EXPECT_TRUE(made.err.starts_with(
      "error: graph.g2o:1:1: the file is a graph of g2o (VERTEX_SE3:QUAT): its edges are relative "
      "poses, which bundle adjustment does not use; expected pixels of points"))
      << made.err;
}

TEST_F(BundleCli, SaysWhatIsWrong) {
  EXPECT_EQ(Call({"bundle", "none.txt"}).code, 66);
  Write("p.txt", "1 1 1\n0 3 1 1\n");
  const Outcome bad = Call({"bundle", "p.txt"});
  EXPECT_EQ(bad.code, 65);
  EXPECT_TRUE(bad.err.starts_with("error: p.txt:2:3: '3' is out of range; expected the point"))
      << bad.err;
  EXPECT_EQ(Call({"bundle", "p.txt", "--loss", "hubert"}).code, 2);
  EXPECT_EQ(Call({"bundle", "p.txt", "--loss", "none=5"}).code, 2);
  EXPECT_EQ(Call({"bundle", "p.txt", "--camera", "c.yaml"}).code, 2);
  EXPECT_EQ(Call({"bundle", "p.txt", "--tolerance", "-1"}).code, 2);
  const Outcome loss = Call({"bundle", "p.txt", "--loss", "huber=1e-20"});
  EXPECT_EQ(loss.code, 2);
  EXPECT_TRUE(Contains(loss.err, "the scale of 'huber=1e-20' is out of bounds; expected 0.001 to"))
      << loss.err;
  for (const char* names : {"k1,,k2", ",", "k1,", ""}) {
    const Outcome empty = Call({"bundle", "p.txt", "--fix", names});
    EXPECT_EQ(empty.code, 2) << names;
    EXPECT_TRUE(Contains(empty.err, "error: --fix: '" + std::string(names) +
                                        "' has an empty name; expected comma-separated names"))
        << empty.err;
  }
  Write("p.txt", BundleText(testing::TrueBundle()));
  const Outcome fix = Call({"bundle", "p.txt", "--fix", "k1,k22"});
  EXPECT_EQ(fix.code, 2);
  EXPECT_TRUE(Contains(fix.err,
                       "'k22' cannot be fixed; expected intrinsics, or focal_px, k1, "
                       "k2; did you mean 'k2'?"))
      << fix.err;
  BundleFile file = testing::TrueBundle();
  testing::Disturb(file.problem);
  Write("p.txt", BundleText(file));
  const Outcome few = Call({"bundle", "p.txt", "--max-iterations", "2"});
  EXPECT_EQ(few.code, 1);
  EXPECT_TRUE(Contains(few.err, "the adjustment has not converged: ")) << few.err;
}

const std::string kScene = R"(alidade: 1
camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
source:
  type: scene
  seed: 3
  max_frames: 15
  STEREO
  points: {box: {min: [-2, -1.5, 3], max: [2, 1.5, 6]}, count: 40}
  trajectory: {look_at: [{position: [-0.5, 0, 0], target: [0, 0, 4]},
                         {position: [0.5, 0, 0], target: [0, 0, 4]}]}
)";

class BundleTracksCli : public BundleCli {
 protected:
  /// Runs `simulate` with kScene. This command writes the folder `data/`.
  void SetUp() override {
    BundleCli::SetUp();
    Simulate("");
  }
  /// Simulates kScene, with the lines of `stereo` added to its source.
  void Simulate(const std::string& stereo, const Arguments& more = {}) const {
    std::string scene = kScene;
    Write("scene.yaml", scene.replace(scene.find("  STEREO\n"), 9, stereo));
    Arguments all = {"simulate", "scene.yaml", "-o", "data", "--force"};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome made = Call(all);
    ASSERT_EQ(made.code, 0) << made.err;
  }
  Outcome Bundle(const std::string& tracks, const std::string& start,
                 const Arguments& more = {}) const {
    Arguments all = {"bundle", tracks, "--camera", "data/calibration.yaml", "--start", start};
    all.insert(all.end(), more.begin(), more.end());
    return Call(all);
  }
  /// Returns the first `count` poses of `data/truth.tum`, with times shifted by `dt_s` and x
  /// shifted by `dx_m`.
  std::string Start(int count, double dt_s, double dx_m) const {
    std::istringstream truth(Read("data/truth.tum"));
    std::string text, line;
    for (int i = 0; i < count && std::getline(truth, line);) {
      if (line.starts_with('#')) continue;
      std::istringstream numbers(line);
      double t = 0.0, x = 0.0;
      numbers >> t >> x;
      text += std::to_string(t + dt_s) + ' ' + std::to_string(x + dx_m * std::sin(++i)) +
              numbers.str().substr(static_cast<std::size_t>(numbers.tellg())) + '\n';
    }
    return text;
  }
};

/// With noise of 1 px in u and in v, the RMS error after the adjustment is sqrt(2 (1 - unknowns /
/// residuals)) px. There are 1000 more residuals than unknowns, so the standard deviation of this
/// RMS error is 2 %.
TEST_F(BundleTracksCli, AdjustsTracks) {
  Write("start.tum", Start(15, 0.0, 0.05));
  const Outcome made = Bundle("data/tracks.csv", "start.tum", {"-o", "out"});
  ASSERT_EQ(made.code, 0) << made.err << made.out;
  EXPECT_TRUE(Contains(made.out, "tracks: 15 cameras, ")) << made.out;
  const Config json = Json("out/bundle.json");
  const auto number = [&](const char* key) { return json.root().At(key).Number(); };
  EXPECT_GT(number("rms_before_px"), 2.5) << "a shift of 5 cm at a distance of 4 m is 6.6 px";
  const double left = std::sqrt(2.0 * (1.0 - number("unknowns") / number("residuals")));
  EXPECT_NEAR(number("rms_after_px"), left, 0.08 * left);
  EXPECT_FALSE(Exists("out/problem.txt"));
  const std::string poses = Read("out/poses.tum");
  EXPECT_EQ(std::count(poses.begin(), poses.end(), '\n'), 15);
}

/// A stereo pair with a baseline of 0.2 m sees points 30 to 45 m away. The disparity of these
/// points is 2 to 4 px with a noise of 1.4 px. Nevertheless, rays over 5 m of path determine the
/// depth of the points to about 1.5 %.
TEST_F(BundleTracksCli, PlacesPointsOfAStereoPairByTheirRays) {
  Simulate("  measures: stereo\n",
           {"--set", "camera.baseline_m=0.2", "--set",
            "source.points={box: {min: [-12, -10, 30], max: [12, 10, 45]}, count: 60}", "--set",
            "source.trajectory={look_at: [{position: [-2.5, 0, 0], target: [0, 0, 38]}, "
            "{position: [2.5, 0, 0], target: [0, 0, 38]}]}"});
  EXPECT_EQ(Json("data/calibration.yaml").root().At("camera").At("baseline_m").Number(), 0.2);
  const Outcome started =
      Bundle("data/tracks.csv", "data/truth.tum", {"-o", "start", "--max-iterations", "0"});
  EXPECT_EQ(started.code, 1) << started.err;
  const auto depths = [&](const std::string& file) {
    std::map<int, double> all;
    std::istringstream rows(Read(file));
    std::string line;
    for (std::getline(rows, line); std::getline(rows, line);)
      all[std::stoi(line)] = std::stod(line.substr(line.rfind(',') + 1));
    return all;
  };
  const std::map<int, double> is = depths("start/points.csv"), was = depths("data/map.csv");
  EXPECT_EQ(is.size(), 60u);
  for (const auto& [id, depth] : is)
    EXPECT_NEAR(depth, was.at(id), 0.07 * was.at(id)) << "point " << id;
  const Outcome made = Bundle("data/tracks.csv", "data/truth.tum", {"-o", "out"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(Contains(made.out, "unknowns: all are determined")) << made.out;
  EXPECT_LT(Json("out/bundle.json").root().At("rms_after_px").Number(),
            Json("start/bundle.json").root().At("rms_after_px").Number());
}

/// The distortion model defines a ray only up to some radius, and the pixel in the corner lies
/// beyond this radius. The other two rays still determine the point.
TEST_F(BundleTracksCli, PlacesAPointThatHasAPixelWithoutARay) {
  Write("data/calibration.yaml",
        "camera: {model: radtan, width: 640, height: 480, fx: 300, fy: 300, cx: 320, cy: 240, "
        "k1: -0.4, k2: 0, p1: 0, p2: 0}");
  Write("tracks.csv", "0,1,0,320\n0,1,1,240\n1,1,0,290.12\n1,1,1,240\n2,1,0,1\n2,1,1,1\n");
  Write("start.tum", "0 0 0 0 0 0 0 1\n1 0.3 0 0 0 0 0 1\n2 0.6 0 0 0 0 0 1\n");
  Bundle("tracks.csv", "start.tum", {"--max-iterations", "0", "-o", "out"});
  EXPECT_TRUE(Contains(Read("out/points.csv"), "\n1,"));
  const std::string points = Read("out/points.csv");
  EXPECT_NEAR(std::stod("0" + points.substr(points.rfind(',') + 1)), 3.0, 1e-6)
      << "the depth is 0.3 m / 0.1, because 0.1 (1 - 0.4 0.01) 300 px = 29.88 px";
}

/// The camera of kScene in the forms of other programs.
TEST_F(BundleTracksCli, ReadsCalibrationsOfOtherPrograms) {
  const Arguments start = {"--max-iterations", "0"};
  const std::string expected = Bundle("data/tracks.csv", "data/truth.tum", start).out;
  const std::string matrix = "[525, 0, 320, 0, 525, 240, 0, 0, 1]";
  for (const std::string& text : {
           "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: {data: " + matrix +
               "}\ndistortion_model: plumb_bob\ndistortion_coefficients: {data: []}\n",
           "height: 480\nwidth: 640\ndistortion_model: rational_polynomial\nd: []\nk: " + matrix +
               "\n---\n",
           std::string("camera_model: pinhole\nresolution: [640, 480]\nintrinsics: [525, 525, 320, "
                       "240]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0, 0, "
                       "0, 0]\n"),
           std::string("cam0: {camera_model: pinhole, resolution: [640, 480], intrinsics: "
                       "[525, 525, 320, 240], distortion_model: none}\nsigma_px: 1\n"),
           std::string("%YAML:1.0\nmodel_type: PINHOLE\nimage_width: 640\nimage_height: "
                       "480\ndistortion_parameters: {k1: 0, k2: 0, p1: 0, p2: "
                       "0}\nprojection_parameters: {fx: 525, fy: 525, cx: 320, cy: 240}\n"),
           std::string("%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 525.\nCamera.fy: "
                       "525.\nCamera.cx: 320.\nCamera.cy: 240.\nCamera.width: 640\nCamera.height: "
                       "480\nCamera.bf: 40.0\n"),
           std::string("include: data/calibration.yaml\nsigma_px: 1\n"),
       }) {
    Write("other.yaml", text);
    Arguments all = {"bundle",     "data/tracks.csv", "--camera",
                     "other.yaml", "--start",         "data/truth.tum"};
    all.insert(all.end(), start.begin(), start.end());
    const Outcome made = Call(all);
    EXPECT_EQ(made.code, 1) << made.err << text;
    EXPECT_EQ(made.out, expected) << text;
  }
  Write("other.yaml", "cam0: {camera_model: omni}\n");
  const Outcome omni =
      Call({"bundle", "data/tracks.csv", "--camera", "other.yaml", "--start", "data/truth.tum"});
  EXPECT_EQ(omni.code, 65);
  EXPECT_TRUE(Contains(omni.err,
                       "other.yaml:1:22 cam0.camera_model: camera model 'omni' is not "
                       "supported; expected pinhole\n"))
      << omni.err;
}

TEST_F(BundleTracksCli, CountsFramesWithoutAPose) {
  Write("start.tum", Start(5, 0.0, 0.0));
  const Outcome made = Bundle("data/tracks.csv", "start.tum", {"-o", "out"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(Contains(made.out, "tracks: 5 cameras, ")) << made.out;
  EXPECT_TRUE(Contains(made.out, "; excluded frames without a pose: 10")) << made.out;
  const std::string rows = Read("data/tracks.csv");
  const Config json = Json("out/bundle.json");
  const auto number = [&](const char* key) { return json.root().At(key).Number(); };
  EXPECT_EQ(number("frames_without_pose"), 10.0);
  EXPECT_EQ(number("points_without_parallax"), 0.0);
  EXPECT_EQ(
      number("observations") + number("observations_of_these") + number("observations_invalid"),
      static_cast<double>(std::count(rows.begin(), rows.end(), '\n') - 1) / 2)
      << "one row for u and one row for v";
  Write("start.tum", Start(5, 100.0, 0.0));
  const Outcome none = Bundle("data/tracks.csv", "start.tum");
  EXPECT_EQ(none.code, 65);
  EXPECT_TRUE(Contains(none.err, "start.tum: no pose has the timestamp of a frame")) << none.err;
}

/// Without timestamps the k-th pose belongs to frame k, regardless of the times of the poses.
/// Tracks from standard input have no timestamps, even if the working folder contains
/// timestamps.csv.
TEST_F(BundleTracksCli, TakesPosesByTheirNumberWhereThereAreNoTimestamps) {
  Write("start.tum", Start(5, 100.0, 0.0));
  Write("tracks.csv", Read("data/tracks.csv"));
  const Outcome file = Bundle("tracks.csv", "start.tum");
  EXPECT_EQ(file.code, 0) << file.err;
  EXPECT_TRUE(Contains(file.out, "tracks: 5 cameras, ")) << file.out;
  Write("timestamps.csv", Read("data/timestamps.csv"));
  EXPECT_EQ(Bundle("tracks.csv", "start.tum").code, 65);
  before_ = "exec <tracks.csv";
  const Outcome piped = Bundle("-", "start.tum");
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_EQ(piped.out, file.out);
}

TEST_F(BundleTracksCli, SaysWhatIsWrong) {
  const std::string rows = "frame,feature,dim,value\n0,1,0,10\n0,1,1,20\n0,1,0,11\n";
  Write("twice.csv", rows);
  const Outcome twice = Bundle("twice.csv", "data/truth.tum");
  EXPECT_EQ(twice.code, 65);
  EXPECT_TRUE(Contains(twice.err, "twice.csv:4: frame, feature and dim equal those of line 2"))
      << twice.err;
  Write("half.csv", "0,1,0,10\n0,2,0,10\n0,2,1,20\n");
  const Outcome half = Bundle("half.csv", "data/truth.tum");
  EXPECT_TRUE(Contains(half.err, "half.csv:1: in frame 0, feature 1 has no row with dim 1"))
      << half.err;
  const std::string start = Read("data/truth.tum");
  const Outcome over = Bundle("data/tracks.csv", "data/truth.tum", {"-o", "data", "--force"});
  EXPECT_EQ(over.code, 73);
  EXPECT_TRUE(Contains(over.err, "data: the folder contains the input 'data/tracks.csv'"))
      << over.err;
  EXPECT_EQ(Read("data/truth.tum"), start);
  const std::string times = Read("data/timestamps.csv");
  Write("data/timestamps.csv", "");
  EXPECT_TRUE(Contains(Bundle("data/tracks.csv", "data/truth.tum").err,
                       "timestamps.csv: the file contains no rows"));
  Write("data/timestamps.csv", times);
  Write("late.tum", "1e300 0 0 0 0 0 0 1\n");
  const Outcome late = Bundle("data/tracks.csv", "late.tum");
  EXPECT_EQ(late.code, 65);
  EXPECT_TRUE(Contains(late.err, "late.tum:1:1 t: '1e300' is beyond 292 years")) << late.err;
  const Outcome fix = Bundle("data/tracks.csv", "data/truth.tum", {"--fix", "k1"});
  EXPECT_EQ(fix.code, 2);
  EXPECT_TRUE(Contains(fix.err, "'k1' cannot be fixed: sensor '")) << fix.err;
  EXPECT_EQ(Bundle("data/tracks.csv", "data/truth.tum", {"--fix", "intrinsics"}).code, 0);
}

TEST_F(BundleCli, AStandardInputThatCannotBeReadIsNotEmpty) {
  before_ = "exec < .";
  const Outcome folder = Call({"bundle", "-"});
  EXPECT_EQ(folder.code, 74);
  EXPECT_TRUE(folder.err.starts_with("error: <stdin>: Is a directory")) << folder.err;
}

/// None of these three problems has a usable observation: a point in the plane of its only camera,
/// a point so far away that its pixels are not finite, and an empty problem.
TEST_F(BundleCli, RefusesAProblemOfWhichNothingIsDefined) {
  const std::string camera = "0\n0\n0\n0\n0\n0\n500\n0\n0\n";
  for (const std::string& text :
       {"1 1 1\n0 0 1 1\n" + camera + "0.1\n0.1\n0\n",
        "1 1 1\n0 0 1 1\n" + camera + "1e200\n0.1\n-3\n", std::string("0 0 0\n")}) {
    Write("p.txt", text);
    const Outcome made = Call({"bundle", "p.txt"});
    EXPECT_EQ(made.code, 65) << text;
    EXPECT_TRUE(made.err.starts_with("error: p.txt: no observation can be used; expected "))
        << made.err;
    EXPECT_EQ(std::count(made.err.begin(), made.err.end(), '\n'), 2) << made.err;
  }
}

/// One observation in four shows a point behind its camera. The formula of BAL also defines the
/// cost of these observations.
TEST_F(BundleCli, CountsAllObservationsOfABalFile) {
  BundleFile file = testing::BundleOnBothSides();
  testing::Disturb(file.problem);
  Write("p.txt", BundleText(file));
  const Outcome made = Call({"bundle", "p.txt", "-o", "out"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_FALSE(Contains(made.out, "excluded")) << made.out;
  const Config json = Json("out/bundle.json");
  const auto number = [&](const char* key) { return json.root().At(key).Number(); };
  EXPECT_EQ(number("residuals"), 2.0 * static_cast<double>(file.problem.observations.size()));
  EXPECT_EQ(number("observations_undefined"), 0.0);
  EXPECT_EQ(number("points_unused"), 0.0);
  std::istringstream before(Read("p.txt")), after(Read("out/problem.txt"));
  EXPECT_NEAR(number("rms_before_px"), testing::BalFormula(before).Rms(), 1e-9);
  EXPECT_NEAR(number("rms_after_px"), testing::BalFormula(after).Rms(), 1e-9);
  EXPECT_LT(number("rms_after_px"), std::sqrt(0.5))
      << "expected less than the noise of the observations";
}

/// The second point lies in the plane of the camera, so it has no pixel. The observation of this
/// point is counted as left out.
TEST_F(BundleCli, CountsWhatIsLeftOut) {
  Write("p.txt", "1 2 2\n0 0 1 1\n0 1 1 1\n0\n0\n0\n0\n0\n0\n500\n0\n0\n0.1\n0.1\n-3\n1\n1\n0\n");
  const Outcome made = Call({"bundle", "p.txt", "-o", "out"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(
      Contains(made.out,
               "2 observations; excluded observations: 1 of points in the plane of the camera, "
               "with residuals that are undefined or not finite at the start"))
      << made.out;
  const Config json = Json("out/bundle.json");
  EXPECT_EQ(json.root().At("observations").Number(), 2.0);
  EXPECT_EQ(json.root().At("observations_undefined").Number(), 1.0);
  EXPECT_EQ(json.root().At("points_unused").Number(), 1.0);
  EXPECT_EQ(json.root().At("cameras_unused").Number(), 0.0);
}

TEST_F(BundleCli, HoldsTheScale) {
  BundleFile file = testing::TrueBundle();
  testing::AddOutliers(file.problem);
  testing::Disturb(file.problem);
  Write("p.txt", BundleText(file));
  const auto extent = [&](const std::string& folder, const Arguments& more) {
    Arguments all = {"bundle", "p.txt", "-o", folder};
    all.insert(all.end(), more.begin(), more.end());
    Call(all);
    std::istringstream rows(Read(folder + "/poses.tum"));
    std::vector<std::array<double, 3>> positions;
    std::string line;
    while (std::getline(rows, line)) {
      double t = 0.0;
      auto& p = positions.emplace_back();
      std::istringstream(line) >> t >> p[0] >> p[1] >> p[2];
    }
    return testing::MedianDistance(positions);
  };
  const double before = extent("start", {"--max-iterations", "0"});
  EXPECT_NEAR(extent("out", {}) / before, 1.0, 1e-12);
  EXPECT_NEAR(Json("out/bundle.json").root().At("extent_after").Number() / before, 1.0, 1e-12);
}

/// The derivative of this pixel with respect to k2 overflows. The message of Ceres is half a page
/// long, but the program prints only one line.
TEST_F(BundleCli, TellsInItsOwnWordsWhatTheSolverSays) {
  Write("p.txt", "1 1 1\n0 0 1 1\n0\n0\n0\n0\n0\n0\n500\n0\n0\n1e80\n0.1\n-1\n");
  const Outcome made = Call({"bundle", "p.txt", "-o", "out"});
  EXPECT_EQ(made.code, 79);
  EXPECT_EQ(made.err, "error: p.txt: Residual and Jacobian evaluation failed.\n");
  EXPECT_FALSE(Exists("out"));
}

/// During the iterations, more than five consecutive steps cannot be computed. With a smaller trust
/// region, further steps can be computed.
TEST_F(BundleCli, GoesOnAfterStepsThatCannotBeComputed) {
  for (const int points : {28, 36}) {
    BundleFile file = testing::BundleOnBothSides(3, points);
    testing::AddOutliers(file.problem);
    testing::Disturb(file.problem);
    Write("p.txt", BundleText(file));
    const Outcome made = Call({"bundle", "p.txt", "--loss", "cauchy=0.1", "--tolerance", "0"});
    EXPECT_EQ(made.code, 0) << made.out << made.err;
  }
}

TEST_F(BundleCli, ConvergesUnderALoss) {
  BundleFile file = testing::BundleOnBothSides();
  testing::AddOutliers(file.problem);
  testing::Disturb(file.problem);
  Write("p.txt", BundleText(file));
  const auto iterations = [&](const Arguments& more) {
    Arguments all = {"bundle", "p.txt", "-o", "out", "--force", "--loss", "huber=0.001"};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome made = Call(all);
    EXPECT_EQ(made.code, 0) << made.err;
    return Json("out/bundle.json").root().At("iterations").Number();
  };
  EXPECT_LT(iterations({"--tolerance", "1e-4"}), iterations({}));
}

}  // namespace
}  // namespace alidade
