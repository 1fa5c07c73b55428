// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

const std::string kScene = R"(alidade: 1
camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
source:
  type: scene
  seed: 3
  max_frames: 20
  simulate_odometry: true
  known_points: {count: 3}
  points: {box: {min: [-2, -1.5, 2], max: [2, 1.5, 6]}, count: 40}
  trajectory: {look_at: [{position: [-0.5, 0, 0], target: [0, 0, 4]},
                         {position: [0.5, 0, 0], target: [0, 0, 4]}]}
)";

class SimulateCli : public testing::ProgramTest {
 protected:
  std::size_t Lines(const std::string& name) const {
    const std::string text = Read(name);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
};

TEST_F(SimulateCli, WritesFilesThatSourceTracksReadsBack) {
  Write("scene.yaml", kScene);
  const Outcome made = Call({"simulate", "scene.yaml", "-o", "data"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(Contains(made.out, "20 frames\nwrote data\n")) << made.out;
  for (const char* name : {"calibration.yaml", "known.csv", "map.csv", "odometry.csv",
                           "timestamps.csv", "tracks.csv", "truth.csv", "truth.tum"}) {
    EXPECT_TRUE(Exists(std::string("data/") + name)) << name;
    EXPECT_TRUE(Contains(made.out, std::string("data/") + name + '\n')) << name;
  }
  EXPECT_EQ(Lines("data/timestamps.csv"), 21u);
  EXPECT_EQ(Lines("data/truth.tum"), 21u);
  EXPECT_EQ(Lines("data/odometry.csv"), 20u);  // no row follows the last frame
  EXPECT_TRUE(Read("data/tracks.csv").starts_with("frame,feature,dim,value\n0,"))
      << "the first line must be the header";
  EXPECT_EQ(Json("data/calibration.yaml").root().At("camera").At("fx").Number(), 525.0);

  // Reading the data and writing them again gives the same bytes.
  Write("again.yaml", "alidade: 1\nsource: {type: tracks, path: data}\n");
  const Outcome again = Call({"simulate", "again.yaml", "-o", "again"});
  ASSERT_EQ(again.code, 0) << again.err;
  for (const char* name :
       {"tracks.csv", "known.csv", "timestamps.csv", "odometry.csv", "truth.tum"}) {
    EXPECT_EQ(Read(std::string("again/") + name), Read(std::string("data/") + name)) << name;
  }
  EXPECT_FALSE(Exists("again/map.csv"));
}

TEST_F(SimulateCli, SaysInItsFolderWhetherItWasStopped) {
  Write("scene.yaml", kScene);
  ASSERT_EQ(Call({"simulate", "scene.yaml", "-o", "whole"}).code, 0);
  EXPECT_EQ(Json("whole/simulate.json").root().At("status").Text(), "ok");
  EXPECT_EQ(Json("whole/simulate.json").root().At("frames").Number(), 20.0);
  // A simulation of 1e6 frames takes more than a minute.
  const pid_t simulate =
      Start({"simulate", "scene.yaml", "-o", "data", "--set", "source.max_frames=1000000"});
  ASSERT_TRUE(Eventually([&] { return Exists("data.partial/tracks.csv"); }));
  ::kill(simulate, SIGTERM);
  EXPECT_EQ(Wait(simulate).code, 75);
  const Config json = Json("data/simulate.json");
  EXPECT_EQ(json.root().At("status").Text(), "stopped");
  EXPECT_EQ(json.root().At("frames").Number(),
            static_cast<double>(Lines("data/timestamps.csv") - 1));
}

TEST_F(SimulateCli, TheSeedReplacesThatOfTheConfig) {
  Write("scene.yaml", kScene);
  const auto tracks = [&](const std::string& folder, const testing::Arguments& more) {
    testing::Arguments all = {"simulate", "scene.yaml", "-o", folder, "--quiet"};
    all.insert(all.end(), more.begin(), more.end());
    EXPECT_EQ(Call(all).code, 0);
    return Read(folder + "/tracks.csv");
  };
  const std::string other = tracks("a", {"--seed", "7"});
  EXPECT_EQ(other, tracks("b", {"--set", "source.seed=7"}));
  EXPECT_EQ(tracks("c", {"--seed", "3"}), tracks("d", {}));
  EXPECT_NE(other, Read("d/tracks.csv"));
}

TEST_F(SimulateCli, NothingReplacesTheDataThatItReads) {
  Write("scene.yaml", kScene);
  ASSERT_EQ(Call({"simulate", "scene.yaml", "-o", "data"}).code, 0);
  Write("again.yaml", "alidade: 1\nsource: {type: tracks, path: data}\n");
  const std::string tracks = Read("data/tracks.csv");
  for (const char* command : {"simulate", "run", "compare"}) {
    const Outcome over = Call({command, "again.yaml", "-o", "data", "--force"});
    EXPECT_EQ(over.code, 73) << command;
    EXPECT_TRUE(over.err.starts_with("error: data: the folder is the input '")) << over.err;
  }
  EXPECT_EQ(Read("data/tracks.csv"), tracks);
  Write("lens.yaml",
        "alidade: 1\ninclude: data/calibration.yaml\nsource: {type: tracks, path: "
        "again}\n");
  ASSERT_EQ(Call({"simulate", "again.yaml", "-o", "again"}).code, 0);
  const Outcome included = Call({"simulate", "lens.yaml", "-o", "data", "--force"});
  EXPECT_EQ(included.code, 73);
  EXPECT_TRUE(Contains(included.err, "data: the folder contains the input '")) << included.err;
  ASSERT_EQ(Call({"run", "config.yaml", "-o", "out"}).code, 0);
  EXPECT_EQ(Call({"simulate", "out/config.resolved.yaml", "-o", "out", "--force"}).code, 73);
}

TEST_F(SimulateCli, DrawsBySeedAndReplacesOnlyByForce) {
  Write("scene.yaml", kScene);
  EXPECT_EQ(Call({"simulate", "scene.yaml", "-o", "a"}).code, 0);
  EXPECT_EQ(Call({"simulate", "scene.yaml", "-o", "b"}).code, 0);
  EXPECT_EQ(Call({"simulate", "scene.yaml", "-o", "c", "--set", "source.seed=4"}).code, 0);
  EXPECT_EQ(Read("a/tracks.csv"), Read("b/tracks.csv"));
  EXPECT_NE(Read("a/tracks.csv"), Read("c/tracks.csv"));
  EXPECT_EQ(Call({"simulate", "scene.yaml", "-o", "a"}).code, 73);
  EXPECT_EQ(Call({"simulate", "scene.yaml", "-o", "a", "--force", "--quiet"}).out, "");
}

TEST_F(SimulateCli, WritesTheStreamsOfAnySource) {
  const Outcome made = Call({"simulate", "config.yaml", "-o", "data"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(
      Read("data/inverse_scale.csv").starts_with("frame,t_s,inverse_scale\n0,0.000000000,"));
  EXPECT_EQ(Lines("data/inverse_scale.csv"), 153u);
  EXPECT_TRUE(Read("data/truth.csv").starts_with("t_s,depth,depth_rate,inverse_distance\n"));
  EXPECT_FALSE(Exists("data/truth.tum"));
  EXPECT_FALSE(Exists("data/calibration.yaml"));
}

TEST_F(SimulateCli, ACalibrationOfAStereoPairHasItsBaseline) {
  std::string scene = kScene + "  measures: stereo\n";
  scene.insert(scene.find("width"), "baseline_m: 0.2, ");
  const std::string known = "  known_points: {count: 3}\n";
  Write("scene.yaml", scene.erase(scene.find(known), known.size()));
  const Outcome made = Call({"simulate", "scene.yaml", "-o", "data"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Json("data/calibration.yaml").root().At("camera").At("baseline_m").Number(), 0.2);
  // A config can include the calibration. The data simulated from this config contain the same
  // calibration.
  const Outcome explained =
      Call({"explain", ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml", "--set",
            "camera.baseline_m=0.2"});
  EXPECT_EQ(explained.code, 0) << explained.err;
  Write("again.yaml",
        "alidade: 1\ninclude: data/calibration.yaml\nsource: {type: tracks, path: data, measures: "
        "stereo}\n");
  const Outcome again = Call({"simulate", "again.yaml", "-o", "again"});
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(Read("again/calibration.yaml"), Read("data/calibration.yaml"));
}

TEST_F(SimulateCli, RefusesAKeyThatNobodyReads) {
  Write("scene.yaml", kScene + "  sigma_p: 2\n");
  const Outcome made = Call({"simulate", "scene.yaml", "-o", "data"});
  EXPECT_EQ(made.code, 78);
  EXPECT_TRUE(Contains(made.err, "source.sigma_p: unknown key; did you mean 'sigma_px'?"))
      << made.err;
  Write("scene.yaml", kScene);
  const Outcome lens = Call({"simulate", "scene.yaml", "-o", "data", "--set", "camera.fz=3"});
  EXPECT_EQ(lens.code, 78);
  EXPECT_TRUE(Contains(lens.err, "camera.fz: unknown key")) << lens.err;
  EXPECT_FALSE(Exists("data"));
}

}  // namespace
}  // namespace alidade
