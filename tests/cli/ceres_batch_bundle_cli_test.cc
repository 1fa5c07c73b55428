// SPDX-License-Identifier: Apache-2.0
#include "support/bundles.h"
#include "support/program.h"

namespace alidade {
namespace {

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
  EXPECT_TRUE(Contains(made.out, "gauge: the pose of the first camera is held")) << made.out;
  EXPECT_TRUE(Contains(made.out, "wrote out\n  out/bundle.json\n")) << made.out;
  const Outcome again = Call({"bundle", "out/problem.txt"});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_LT(Json("out/bundle.json").root().At("rms_after_px").Number(), 1e-8);
  EXPECT_EQ(Call({"bundle", "p.txt", "-o", "out"}).code, 73);
  EXPECT_EQ(Call({"bundle", "p.txt", "-o", "out", "--force", "--quiet"}).out, "");
}

TEST_F(BundleCli, SaysWhatIsWrong) {
  EXPECT_EQ(Call({"bundle", "none.txt"}).code, 66);
  Write("p.txt", "1 1 1\n0 3 1 1\n");
  const Outcome bad = Call({"bundle", "p.txt"});
  EXPECT_EQ(bad.code, 65);
  EXPECT_TRUE(bad.err.starts_with("error: p.txt:2:3: '3' is none; expected the point")) << bad.err;
  EXPECT_EQ(Call({"bundle", "p.txt", "--loss", "hubert"}).code, 2);
  EXPECT_EQ(Call({"bundle", "p.txt", "--camera", "c.yaml"}).code, 2);
  Write("p.txt", BundleText(testing::TrueBundle()));
  const Outcome fix = Call({"bundle", "p.txt", "--fix", "k1,k22"});
  EXPECT_EQ(fix.code, 2);
  EXPECT_TRUE(Contains(fix.err,
                       "'k22' cannot be fixed; expected intrinsics, or of focal_px, k1, "
                       "k2; did you mean 'k2'?"))
      << fix.err;
  BundleFile file = testing::TrueBundle();
  testing::Disturb(file.problem);
  Write("p.txt", BundleText(file));
  const Outcome few = Call({"bundle", "p.txt", "--iterations", "2"});
  EXPECT_EQ(few.code, 1);
  EXPECT_TRUE(Contains(few.err, "not converged: ")) << few.err;
}

const std::string kScene = R"(alidade: 1
camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240}
source:
  type: scene
  seed: 3
  frames: 15
  STEREO
  points: {box: {min: [-2, -1.5, 3], max: [2, 1.5, 6]}, count: 40}
  trajectory: {look_at: [{position: [-0.5, 0, 0], target: [0, 0, 4]},
                         {position: [0.5, 0, 0], target: [0, 0, 4]}]}
)";

/// Tracks as `simulate` writes them, from their true poses: what is left is the noise of a pixel.
TEST_F(BundleCli, AdjustsTracks) {
  std::string scene = kScene;
  Write("scene.yaml", scene.replace(scene.find("  STEREO\n"), 9, ""));
  ASSERT_EQ(Call({"simulate", "scene.yaml", "-o", "data"}).code, 0);
  const Outcome made = Call({"bundle", "data/tracks.csv", "--camera", "data/calibration.yaml",
                             "--start", "data/truth.tum", "-o", "out"});
  ASSERT_EQ(made.code, 0) << made.err << made.out;
  EXPECT_TRUE(Contains(made.out, "tracks: 15 cameras, ")) << made.out;
  const double rms = Json("out/bundle.json").root().At("rms_after_px").Number();
  EXPECT_LT(rms, 1.6);
  EXPECT_FALSE(Exists("out/problem.txt"));
  const std::string poses = Read("out/poses.tum");
  EXPECT_EQ(std::count(poses.begin(), poses.end(), '\n'), 15);

  const std::string rows = "frame,feature,dim,value\n0,1,0,10\n0,1,1,20\n0,1,0,11\n";
  Write("twice.csv", rows);
  const Outcome twice = Call(
      {"bundle", "twice.csv", "--camera", "data/calibration.yaml", "--start", "data/truth.tum"});
  EXPECT_EQ(twice.code, 65);
  EXPECT_TRUE(Contains(twice.err, "twice.csv:4:1: the same frame, feature and dim as line 2"))
      << twice.err;
  Write("half.csv", "0,1,0,10\n");
  EXPECT_TRUE(Contains(
      Call({"bundle", "half.csv", "--camera", "data/calibration.yaml", "--start", "data/truth.tum"})
          .err,
      "frame 0 has no dim 1 of feature 1"));
}

}  // namespace
}  // namespace alidade
