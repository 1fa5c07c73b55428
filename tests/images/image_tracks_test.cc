// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <sstream>
#include <vector>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

constexpr const char* kDiscs = R"(alidade: 1
camera: {model: pinhole, width: 320, height: 240, fx: 260, fy: 260, cx: 160, cy: 120}
source:
  type: scene
  seed: 5
  max_frames: 20
  rate_hz: 20
  sigma_px: 0
  points: {box: {min: [-2, -1.5, 3], max: [2, 1.5, 5]}, count: 25}
  trajectory: {look_at: [{position: [-0.2, 0, 0], target: [0, 0, 4]},
                         {position: [0.2, 0.1, 0], target: [0, 0, 4]}]}
)";

constexpr const char* kFollow = R"(alidade: 1
source: {type: image_tracks, path: scene/images, rate_hz: 20, features: 40}
)";

struct Seen {
  int feature;
  double u, v;
};
using ByFrame = std::map<int, std::vector<Seen>>;

class ImageTracks : public testing::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    Write("scene.yaml", kDiscs);
    Write("config.yaml", kFollow);
  }
  void MakeImages(testing::Arguments more = {"--images", "images"}) {
    more.insert(more.begin(), {"simulate", "scene.yaml", "-o", "scene"});
    const Outcome made = Call(more);
    ASSERT_EQ(made.code, 0) << made.err;
  }
  /// The tracks of the images, by `alidade simulate`.
  Outcome Track(testing::Arguments more = {}) {
    more.insert(more.begin(), {"simulate", "config.yaml", "-o", "found", "--force"});
    return Call(more);
  }
  ByFrame Rows(const std::string& name) const {
    ByFrame frames;
    std::istringstream rows(Read(name));
    std::string row;
    std::getline(rows, row);
    while (std::getline(rows, row)) {
      int frame = 0, feature = 0, dim = 0;
      double value = 0.0;
      EXPECT_EQ(std::sscanf(row.c_str(), "%d,%d,%d,%lf", &frame, &feature, &dim, &value), 4);
      std::vector<Seen>& seen = frames[frame];
      if (seen.empty() || seen.back().feature != feature) seen.push_back({feature, 0.0, 0.0});
      (dim == 0 ? seen.back().u : seen.back().v) = value;
    }
    return frames;
  }
  cv::Mat Image(int k) const { return cv::imread(ImageFile(k), cv::IMREAD_GRAYSCALE); }
  std::string ImageFile(int k) const {
    char name[32];
    std::snprintf(name, sizeof name, "%06d.png", k);
    return (folder_ / "scene/images" / name).string();
  }
};

/// The true feature nearest to one that was found, and how far it is.
std::pair<int, double> Nearest(const std::vector<Seen>& truth, const Seen& found) {
  std::pair<int, double> nearest{-1, 1e9};
  for (const Seen& t : truth) {
    const double off = std::hypot(t.u - found.u, t.v - found.v);
    if (off < nearest.second) nearest = {t.feature, off};
  }
  return nearest;
}

TEST_F(ImageTracks, FollowOneThingAsLongAsTheyLive) {
  MakeImages();
  const Outcome outcome = Track();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const ByFrame truth = Rows("scene/tracks.csv"), found = Rows("found/tracks.csv");
  ASSERT_EQ(found.size(), 20u);
  // Corners lie on the rims of discs of radius 4 px: what a track is off its disc must stay.
  struct Life {
    int of = -1;
    double du = 0.0, dv = 0.0;
    int frames = 0;
  };
  std::map<int, Life> lives;
  int long_ones = 0;
  std::vector<double> off_px;
  for (const auto& [frame, features] : found) {
    EXPECT_LE(features.size(), 40u);
    std::set<int> ids;
    for (const Seen& one : features) {
      EXPECT_TRUE(ids.insert(one.feature).second) << "twice in frame " << frame;
      Life& life = lives[one.feature];
      for (const Seen& t : truth.at(frame)) {
        if (life.of < 0 || t.feature != life.of) continue;
        off_px.push_back(std::hypot(one.u - t.u - life.du, one.v - t.v - life.dv));
      }
      if (life.frames++ == 0) {
        const auto [of, off] = Nearest(truth.at(frame), one);
        if (off > 6.0) continue;  // the number of the frame, and where discs touch
        life.of = of;
        for (const Seen& t : truth.at(frame)) {
          if (t.feature == of) life.du = one.u - t.u, life.dv = one.v - t.v;
        }
      }
      if (life.frames == 20 && life.of >= 0) ++long_ones;
    }
  }
  EXPECT_GT(long_ones, 12);
  // Where the rims of two discs cross, the corner is of neither: some of 25 discs touch.
  ASSERT_GT(off_px.size(), 300u);
  std::ranges::sort(off_px);
  EXPECT_LT(off_px[off_px.size() / 2], 0.1);
  EXPECT_LT(off_px[off_px.size() * 8 / 10], 0.3);
}

TEST_F(ImageTracks, AreSpreadAndApart) {
  MakeImages();
  ASSERT_EQ(Track({"--set", "source.distance_px=20"}).code, 0);
  const std::vector<Seen> first = Rows("found/tracks.csv").at(0);
  ASSERT_GT(first.size(), 5u);
  for (const Seen& a : first) {
    for (const Seen& b : first) {
      if (a.feature == b.feature) continue;
      // Sub-pixel places may come up to 5 px nearer than the corners that were taken.
      EXPECT_GT(std::hypot(a.u - b.u, a.v - b.v), 14.0);
    }
  }
}

TEST_F(ImageTracks, OfAVideoHaveItsTimes) {
  MakeImages({"--video", "video.avi"});
  const Outcome outcome =
      Track({"--set", "source.path=scene/video.avi", "--set", "source.rate_hz=0"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(Rows("found/tracks.csv").size(), 20u);
  EXPECT_TRUE(Contains(Read("found/timestamps.csv"), "\n19,0.950000000\n"))
      << Read("found/timestamps.csv");
}

TEST_F(ImageTracks, TakeTimesAndPosesFromBesideTheImages) {
  MakeImages();
  for (const char* name : {"timestamps.csv", "truth.tum", "calibration.yaml"}) {
    std::filesystem::copy(folder_ / "scene" / name, folder_ / "scene/images" / name);
  }
  const Outcome outcome = Track({"--set", "source.rate_hz=0", "--set", "source.start_frame=3"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(Rows("found/tracks.csv").size(), 17u);
  EXPECT_TRUE(Contains(Read("found/timestamps.csv"), "\n0,0.150000000\n"))
      << Read("found/timestamps.csv");
  EXPECT_TRUE(Exists("found/truth.tum"));
}

TEST_F(ImageTracks, RefuseWhatIsNoImage) {
  MakeImages();
  const Outcome none = Track({"--set", "source.path=nowhere"});
  EXPECT_EQ(none.code, 66) << none.err;
  EXPECT_TRUE(Contains(none.err, "no such file or folder")) << none.err;
  const Outcome unmatched = Track({"--set", "source.images=left_*.png"});
  EXPECT_EQ(unmatched.code, 66) << unmatched.err;
  EXPECT_TRUE(Contains(unmatched.err, "matches 'left_*.png'")) << unmatched.err;
  const Outcome no_time = Track({"--set", "source.rate_hz=0"});
  EXPECT_EQ(no_time.code, 78) << no_time.err;
  EXPECT_TRUE(Contains(no_time.err, "no timestamps.csv next to the images")) << no_time.err;

  std::filesystem::resize_file(ImageFile(7), std::filesystem::file_size(ImageFile(7)) / 2);
  const Outcome cut = Track();
  EXPECT_EQ(cut.code, 65) << cut.err;
  EXPECT_TRUE(Contains(cut.err, "000007.png")) << cut.err;
  std::filesystem::resize_file(ImageFile(7), 0);
  const Outcome empty = Track();
  EXPECT_EQ(empty.code, 65) << empty.err;
  EXPECT_TRUE(Contains(empty.err, "000007.png: an empty file")) << empty.err;
  cv::imwrite(ImageFile(7), cv::Mat(120, 160, CV_8UC1, cv::Scalar(9)));
  const Outcome small = Track();
  EXPECT_EQ(small.code, 65) << small.err;
  EXPECT_TRUE(Contains(small.err, "000007.png: 160x120 px, but the first image is 320x240 px"))
      << small.err;
}

// Its decoder gives a whole image of what is left, grey below.
TEST_F(ImageTracks, RefuseAJpegThatIsCutShort) {
  MakeImages();
  const std::string jpeg = (folder_ / "scene/images/000003.jpg").string();
  cv::imwrite(jpeg, Image(3));
  std::filesystem::remove(ImageFile(3));
  ASSERT_EQ(Track().code, 0);
  std::filesystem::resize_file(jpeg, std::filesystem::file_size(jpeg) * 3 / 4);
  const Outcome cut = Track();
  EXPECT_EQ(cut.code, 65) << cut.err;
  EXPECT_TRUE(Contains(cut.err, "000003.jpg: the image is cut short")) << cut.err;
}

TEST_F(ImageTracks, EndInABlackImageAndBeginAnewAfterIt) {
  MakeImages();
  cv::imwrite(ImageFile(9), cv::Mat(240, 320, CV_8UC1, cv::Scalar(0)));
  const Outcome outcome = Track();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const ByFrame found = Rows("found/tracks.csv");
  EXPECT_FALSE(found.contains(9));
  std::set<int> before;
  for (const Seen& one : found.at(8)) before.insert(one.feature);
  ASSERT_FALSE(found.at(10).empty());
  for (const Seen& one : found.at(10)) EXPECT_FALSE(before.contains(one.feature));
}

// A camera that hangs: the same image again is the same features.
TEST_F(ImageTracks, StandStillInAFrozenImage) {
  MakeImages();
  std::filesystem::copy_file(ImageFile(8), ImageFile(9),
                             std::filesystem::copy_options::overwrite_existing);
  ASSERT_EQ(Track().code, 0);
  const ByFrame found = Rows("found/tracks.csv");
  std::map<int, Seen> before;
  for (const Seen& one : found.at(8)) before[one.feature] = one;
  int again = 0;
  for (const Seen& one : found.at(9)) {
    if (!before.contains(one.feature)) continue;
    ++again;
    EXPECT_NEAR(one.u, before[one.feature].u, 1e-3);
    EXPECT_NEAR(one.v, before[one.feature].v, 1e-3);
  }
  EXPECT_EQ(again, static_cast<int>(before.size()));
}

TEST_F(ImageTracks, AnImageThatIsGoneIsMissedByItsTime) {
  MakeImages();
  std::ostringstream times;
  for (int k = 0; k < 20; ++k) times << k << ',' << 0.05 * k << '\n';
  Write("scene/images/timestamps.csv", times.str());
  const testing::Arguments by_table{"--set", "source.rate_hz=0"};
  EXPECT_EQ(Track(by_table).code, 0);
  std::filesystem::remove(ImageFile(7));
  const Outcome gone = Track(by_table);
  EXPECT_EQ(gone.code, 65);
  EXPECT_TRUE(Contains(gone.err, "has a time for image 19, but there are 19 images")) << gone.err;
}

// Example 25, from pixels to the way of the camera: as good as from tracks with noise of 0.1 px and
// no drift, within a half.
TEST_F(ImageTracks, LeadTheFilterAsPerfectTracksDo) {
  const std::string example = std::string(ALIDADE_SOURCE_DIR) + "/examples/25_slam_images/";
  const Outcome drawn =
      Call({"simulate", example + "scene.yaml", "-o", "room", "--images", "images"});
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  const auto rmse_of = [&](const std::string& source) {
    const Outcome run =
        Call({"run", example + "config.yaml", "--set", source, "-o", "run", "--force"});
    EXPECT_EQ(run.code, 0) << run.err;
    const Outcome eval = Call({"eval", "room/truth.tum", "run", "--align-mode", "sim3", "--json"});
    EXPECT_EQ(eval.code, 0) << eval.err;
    const std::size_t at = eval.out.find("\"rmse\":");
    return at == std::string::npos ? NAN : std::stod(eval.out.substr(at + 7));
  };
  const double perfect =
      rmse_of("source={type: tracks, path: " + (folder_ / "room").string() + "}");
  const double seen = rmse_of("source.path=" + (folder_ / "room/images").string());
  EXPECT_GT(perfect, 0.0005);
  EXPECT_LT(perfect, 0.004);  // m
  EXPECT_LT(seen, 1.5 * perfect);
}

TEST_F(ImageTracks, PointsOfKnownDepthGiveTheMapItsScale) {
  constexpr const char* kCamera =
      "camera: {model: pinhole, width: 320, height: 240, fx: 260, fy: 260, cx: 160, cy: 120}\n";
  Write("scene.yaml", std::string("alidade: 1\n") + kCamera + R"(source:
  type: scene
  max_frames: 60
  sigma_px: 0
  points: {room: {min: [-2, -1.3, -1], max: [2, 1.3, 3.5]}, count: 200}
  surfaces: [{box: {min: [-2, -1.3, -1], max: [2, 1.3, 3.5]}, grain_m: 0.6}]
  trajectory: {look_at: [{position: [0, 0, 0], target: [0, 0, 3]},
                         {position: [0.2, -0.1, 0.1], target: [0, 0, 3]},
                         {position: [0.5, 0.1, 0.2], target: [0, 0, 3]}]}
)");
  MakeImages();
  // The camera is at the origin first: the depth of a point is its z.
  std::map<int, double> depth_m;
  std::istringstream map(Read("scene/map.csv"));
  std::string row;
  std::getline(map, row);
  while (std::getline(map, row)) {
    int id = 0;
    double x = 0.0, y = 0.0, z = 0.0;
    ASSERT_EQ(std::sscanf(row.c_str(), "%d,%lf,%lf,%lf", &id, &x, &y, &z), 4);
    depth_m[id] = z;
  }
  std::ostringstream known;
  int count = 0;
  known << "u,v,depth_m\n";
  for (const Seen& one : Rows("scene/tracks.csv").at(0)) {
    if (one.u < 30 || one.v < 30 || one.u > 290 || one.v > 210 || count == 6) continue;
    known << one.u << ',' << one.v << ',' << depth_m.at(one.feature) << '\n';
    ++count;
  }
  ASSERT_EQ(count, 6);
  Write("known.csv", known.str());
  Write("config.yaml", std::string("alidade: 1\n") + kCamera + R"(state:
  cam:
    model: quaternion_pose
    noise: {kind: continuous, linear_acceleration: 0.3, angular_acceleration: 0.1}
    initial:
      position: {mean: [0, 0, 0], sigma: 0}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}
      velocity: {mean: [0, 0, 0], sigma: 0.3}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.3}
landmarks: {representation: inverse_depth, prior: {inverse_distance: 0.4, sigma: 0.12}}
sensors:
  pixels: {model: inverse_depth_feature, stream: tracks, sigma_px: 0.15,
           roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}}
  known: {model: depth_feature, stream: known, sigma_px: 0.15, sigma_depth_m: 0.01,
          roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}}
source: {type: image_tracks, path: scene/images, rate_hz: 30, features: 60, known: known.csv}
estimators: {ekf: {type: ekf, gate: 0.999}}
)");
  const auto scale = [&](const testing::Arguments& more) {
    testing::Arguments arguments{"run", "config.yaml", "-o", "run", "--force", "--no-figures"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome run = Call(arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    const Outcome eval = Call({"eval", "scene/truth.tum", "run", "--align-mode", "sim3", "--json"});
    EXPECT_EQ(eval.code, 0) << eval.err;
    const std::size_t at = eval.out.find("\"scale\":");
    return at == std::string::npos ? NAN : std::stod(eval.out.substr(at + 8));
  };
  EXPECT_NEAR(scale({}), 1.0, 0.03);
  // Depths that are half as large make the map half as large.
  std::ostringstream half;
  for (std::istringstream rows(known.str()); std::getline(rows, row);) {
    double u = 0.0, v = 0.0, depth = 0.0;
    if (std::sscanf(row.c_str(), "%lf,%lf,%lf", &u, &v, &depth) == 3) {
      half << u << ',' << v << ',' << 0.5 * depth << '\n';
    }
  }
  Write("known.csv", half.str());
  EXPECT_NEAR(scale({"--set", "landmarks.prior.inverse_distance=0.8", "--set",
                     "landmarks.prior.sigma=0.24"}),
              2.0, 0.06);
  Write("known.csv", "u,v,depth_m\n3,30,2\n");
  const Outcome rim = Call({"run", "config.yaml", "-o", "run", "--force"});
  EXPECT_EQ(rim.code, 65);
  EXPECT_TRUE(Contains(rim.err, "known.csv:2: the point is not on the image")) << rim.err;
}

// Example 29: the target on the desk of MonoSLAM is 0.21 m wide and 0.1485 m high.
TEST_F(ImageTracks, AKnownTargetGivesARecordedDeskItsScale) {
  const char* const data = std::getenv("ALIDADE_DATA");
  const std::filesystem::path frames =
      std::filesystem::path(data == nullptr ? "" : data) / "mono-davison-desk/frames";
  if (data == nullptr || !std::filesystem::exists(frames)) {
    GTEST_SKIP() << "ALIDADE_DATA has no mono-davison-desk";
  }
  const std::string example =
      std::string(ALIDADE_SOURCE_DIR) + "/examples/29_slam_recorded_images/config.yaml";
  const Outcome run = Call(
      {"run", example, "--set", "source.path=" + frames.string(), "-o", "run", "--no-figures"});
  ASSERT_EQ(run.code, 0) << run.err;
  std::map<int, std::array<double, 3>> place;
  std::istringstream rows(Read("run/ekf/landmarks.csv"));
  std::string row;
  while (std::getline(rows, row)) {
    int id = 0, generation = 0;
    double x = 0.0, y = 0.0, z = 0.0;
    if (std::sscanf(row.c_str(), "%d,%d,inverse_depth,%lf,%lf,%lf", &id, &generation, &x, &y, &z) ==
        5) {
      place[id] = {x, y, z};
    }
  }
  const auto length = [&](int from, int to) {
    const auto& a = place.at(from);
    const auto& b = place.at(to);
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  };
  EXPECT_NEAR(0.5 * (length(0, 1) + length(2, 3)), 0.21, 0.02 * 0.21);
  EXPECT_NEAR(0.5 * (length(0, 2) + length(1, 3)), 0.1485, 0.02 * 0.1485);
}

}  // namespace
}  // namespace alidade
