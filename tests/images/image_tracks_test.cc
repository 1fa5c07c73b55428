// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "alidade/config/config.h"
#include "alidade/experiment/source.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/plugin/plugin_host.h"
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

constexpr const char* kGuided = R"(alidade: 1
camera: {model: pinhole, width: 320, height: 240, fx: 260, fy: 260, cx: 160, cy: 120}
state:
  cam:
    model: quaternion_pose
    noise: {kind: continuous, linear_acceleration: 0.1, angular_acceleration: 1}
    initial:
      position: {mean: [0, 0, 0], sigma: 0}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}
      velocity: {mean: [0, 0, 0], sigma: 0.3}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.5}
landmarks:
  representation: inverse_depth
  prior: {inverse_distance: 0.4, sigma: 0.1}
sensors:
  pixels:
    model: inverse_depth_feature
    stream: tracks
    roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}
    sigma_px: 0.3
source: {type: image_tracks, path: scene/images, rate_hz: 10, features: 40, guide: ekf}
estimators: {ekf: {type: ekf, gate: 0.999}}
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
  /// Extracts the tracks from the images with `alidade simulate`.
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

/// Returns the true feature that is nearest to `found`, and its distance from `found`.
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
  // Corners lie on the rims of discs of radius 4 px. The offset of a track from the centre of its
  // disc must be constant.
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
      EXPECT_TRUE(ids.insert(one.feature).second) << "a feature occurs twice in frame " << frame;
      Life& life = lives[one.feature];
      for (const Seen& t : truth.at(frame)) {
        if (life.of < 0 || t.feature != life.of) continue;
        off_px.push_back(std::hypot(one.u - t.u - life.du, one.v - t.v - life.dv));
      }
      if (life.frames++ == 0) {
        const auto [of, off] = Nearest(truth.at(frame), one);
        if (off > 6.0) continue;  // excludes corners of the drawn number and of discs that touch
        life.of = of;
        for (const Seen& t : truth.at(frame)) {
          if (t.feature == of) life.du = one.u - t.u, life.dv = one.v - t.v;
        }
      }
      if (life.frames == 20 && life.of >= 0) ++long_ones;
    }
  }
  EXPECT_GT(long_ones, 12);
  // Some of the 25 discs touch. A corner at which two rims cross belongs to neither disc.
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
      // Sub-pixel refinement may move features up to 5 px closer to each other than the selected
      // corners.
      EXPECT_GT(std::hypot(a.u - b.u, a.v - b.v), 14.0);
    }
  }
}

// A small square has four corners, but refinement moves all four corners to one stable point, the
// centre of the square.
TEST_F(ImageTracks, DoNotShareAPoint) {
  Write("config.yaml", R"(alidade: 1
source:
  {type: image_tracks, path: squares, rate_hz: 10,
   distance_px: 3, corner_px: 3, grid_columns: 2, grid_rows: 2}
)");
  std::filesystem::create_directories(folder_ / "squares");
  cv::Mat image(240, 320, CV_8UC1, cv::Scalar(40));
  for (const int x : {60, 150, 250}) {
    for (const int y : {60, 170}) image(cv::Rect(x, y, 8, 8)).setTo(200);
  }
  ASSERT_TRUE(cv::imwrite((folder_ / "squares/0.png").string(), image));
  const Outcome tracked = Track();
  ASSERT_EQ(tracked.code, 0) << tracked.err;
  const std::vector<Seen> found = Rows("found/tracks.csv").at(0);
  EXPECT_GE(found.size(), 6u);
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT(std::hypot(found[i].u - found[j].u, found[i].v - found[j].v), 2.0) << i << ' ' << j;
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
  EXPECT_TRUE(Contains(cut.err, "000007.png: the image file is incomplete")) << cut.err;
  EXPECT_FALSE(Contains(cut.err, "libpng")) << cut.err;
  std::filesystem::resize_file(ImageFile(7), 0);
  const Outcome empty = Track();
  EXPECT_EQ(empty.code, 65) << empty.err;
  EXPECT_TRUE(Contains(empty.err, "000007.png: the file is empty")) << empty.err;
  cv::imwrite(ImageFile(7), cv::Mat(120, 160, CV_8UC1, cv::Scalar(9)));
  const Outcome small = Track();
  EXPECT_EQ(small.code, 65) << small.err;
  EXPECT_TRUE(
      Contains(small.err, "000007.png: the image is 160x120 px, but the first image is 320x240 px"))
      << small.err;
}

// Images of another size belong to another camera, so their pixels must not be used.
TEST_F(ImageTracks, AreOfImagesAsLargeAsTheCamera) {
  MakeImages();
  Write("config.yaml",
        "alidade: 1\ncamera: {model: pinhole, width: 640, height: 480, fx: 1, fy: 1, cx: 0, cy: "
        "0}\nsource: {type: image_tracks, path: scene/images, rate_hz: 20, start_frame: 2}\n");
  const Outcome other = Track();
  EXPECT_EQ(other.code, 65) << other.err;
  EXPECT_TRUE(Contains(other.err,
                       "000002.png: the image is 320x240 px, but the camera of config.yaml:2 has "
                       "640x480 px"))
      << other.err;
  EXPECT_EQ(Track({"--set", "camera.width=320", "--set", "camera.height=240"}).code, 0);

  // The same check applies to the camera of a sensor entry and to the camera stored with the
  // images.
  Write("config.yaml", kGuided);
  EXPECT_EQ(Call({"run", "config.yaml", "-o", "run"}).code, 0);
  const std::string guided = kGuided;
  Write("config.yaml", "alidade: 1\n" + guided.substr(guided.find("state:")));
  const Outcome own = Call({"run", "config.yaml", "-o", "own", "--set",
                            "sensors.pixels.camera={model: pinhole, width: 319, height: 240, fx: "
                            "260, fy: 260, cx: 160, cy: 120}"});
  EXPECT_EQ(own.code, 65) << own.err;
  EXPECT_TRUE(Contains(own.err, "000000.png: the image is 320x240 px, but the camera of"))
      << own.err;
  Write("config.yaml", kFollow);
  Write("scene/images/calibration.yaml",
        "camera: {model: pinhole, width: 640, height: 480, fx: 1, fy: 1, cx: 0, cy: 0}\n");
  const Outcome beside = Track();
  EXPECT_EQ(beside.code, 65) << beside.err;
  EXPECT_TRUE(Contains(beside.err, "calibration.yaml:1:33 has 640x480 px")) << beside.err;
  EXPECT_EQ(Track({"--set", "source.calibration=ignore"}).code, 0);
}

TEST_F(ImageTracks, BeginAtAnImageThatIsThere) {
  MakeImages();
  EXPECT_EQ(Track({"--set", "source.start_frame=19"}).code, 0);
  Write("config.yaml",
        "alidade: 1\nsource:\n  {type: image_tracks, path: scene/images, rate_hz: 20,\n"
        "   start_frame: 20}\n");
  const Outcome folder = Track();
  EXPECT_EQ(folder.code, 78) << folder.err;
  EXPECT_TRUE(Contains(folder.err,
                       "config.yaml:4:17 source.start_frame: image 20 does not exist; the source "
                       "has 20 images, counted from 0; expected at most 19"))
      << folder.err;
  MakeImages({"--video", "video.avi", "--force"});
  const Outcome video = Track({"--set", "source.path=scene/video.avi"});
  EXPECT_EQ(video.code, 78) << video.err;
  EXPECT_TRUE(Contains(video.err, "start_frame: image 20 does not exist")) << video.err;
}

TEST_F(ImageTracks, AreNotOfImagesSmallerThanTheirPatch) {
  MakeImages();
  cv::imwrite((folder_ / "scene/images/s.png").string(), Image(0)(cv::Rect(0, 0, 102, 102)));
  const testing::Arguments of_small{"--set", "source.images=s*.png"};
  EXPECT_EQ(Track(of_small).code, 0);
  const Outcome refused = Track({of_small[0], of_small[1], "--set", "source.window_px=101"});
  EXPECT_EQ(refused.code, 65) << refused.err;
  EXPECT_TRUE(Contains(
      refused.err, "s.png: the image is 102x102 px, but a tracked patch of 101 px with its rim"))
      << refused.err;
  EXPECT_TRUE(Contains(refused.err, "at least 103 px")) << refused.err;
}

// The decoder returns an image of full size, in which the missing part is grey.
TEST_F(ImageTracks, RefuseAJpegThatIsCutShort) {
  MakeImages();
  const std::string jpeg = (folder_ / "scene/images/000003.jpg").string();
  cv::imwrite(jpeg, Image(3));
  std::filesystem::remove(ImageFile(3));
  ASSERT_EQ(Track().code, 0);
  std::filesystem::resize_file(jpeg, std::filesystem::file_size(jpeg) * 3 / 4);
  const Outcome cut = Track();
  EXPECT_EQ(cut.code, 65) << cut.err;
  EXPECT_TRUE(Contains(cut.err, "000003.jpg: the image file is incomplete")) << cut.err;
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

// The camera is frozen. A repeated image has the same features as the previous image.
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

TEST_F(ImageTracks, HaveTheTimesOfTheLayoutsOfEurocTumAndKitti) {
  MakeImages();
  const std::filesystem::path images = folder_ / "scene/images";
  std::string euroc = "#timestamp [ns],filename\n", tum = "# timestamp filename\n", kitti;
  for (int k = 0; k < 20; ++k) {
    const std::string name = std::filesystem::path(ImageFile(k)).filename().string();
    euroc += std::to_string(1403636579763555584 + 50'000'000L * k) + ',' + name + "\r\n";
    tum += std::to_string(1305031452 + k) + ".25 rgb/" + name + '\n';
    kitti += std::to_string(k) + ".5e-01\n";
  }
  const auto lay = [&](const std::string& to) {
    std::filesystem::create_directories(folder_ / to);
    for (int k = 0; k < 20; ++k) {
      const std::filesystem::path file = ImageFile(k);
      std::filesystem::copy_file(file, folder_ / to / file.filename());
    }
  };
  lay("euroc/cam0/data");
  Write("euroc/cam0/data.csv", euroc);
  Write("euroc/cam0/sensor.yaml",
        "sensor_type: camera\nresolution: [320, 240]\ncamera_model: pinhole\n"
        "intrinsics: [261, 262, 160, 120]\ndistortion_model: radial-tangential\n"
        "distortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n");
  lay("tum/rgb");
  Write("tum/rgb.txt", tum);
  Write("tum/groundtruth.txt", "# t x y z qx qy qz qw\n1305031453.2549 1 2 3 0 0 0 1\n");
  lay("kitti/image_0");
  Write("kitti/times.txt", kitti);
  const auto track = [&](const std::string& path) {
    return Track({"--set", "source.rate_hz=0", "--set", "source.path=" + path});
  };
  ASSERT_EQ(track("euroc/cam0/data").code, 0);
  EXPECT_TRUE(Contains(Read("found/timestamps.csv"), "\n1,1403636579.813555584\n"));
  const std::string guided = kGuided;
  Write("no_camera.yaml", "alidade: 1\n" + guided.substr(guided.find("state:")));
  const Outcome explained = Call({"explain", "no_camera.yaml", "--set", "source.rate_hz=0", "--set",
                                  "source.path=euroc/cam0/data"});
  EXPECT_TRUE(Contains(explained.out, "261")) << explained.out << explained.err;
  ASSERT_EQ(track("tum/rgb/").code, 0);
  EXPECT_TRUE(Contains(Read("found/timestamps.csv"), "\n1,1305031453.250000000\n"));
  EXPECT_TRUE(Contains(Read("found/truth.tum"), "1305031453.250000000 1 2 3"))
      << Read("found/truth.tum");  // the timestamp is off by 4.9 ms
  ASSERT_EQ(track("kitti/image_0").code, 0);
  EXPECT_TRUE(Contains(Read("found/timestamps.csv"), "\n19,1.950000000\n"))
      << Read("found/timestamps.csv");

  // If file names are timestamps, a missing image is harmless. A missing timestamp is an error.
  std::filesystem::remove(folder_ / "tum/rgb/000019.png");
  EXPECT_EQ(track("tum/rgb").code, 0);
  std::string back = tum;
  back.replace(back.find("1305031455"), 10, "1305031454");
  Write("tum/rgb.txt", back);
  const Outcome not_after = track("tum/rgb");
  EXPECT_EQ(not_after.code, 65);
  EXPECT_TRUE(Contains(not_after.err,
                       "rgb.txt:5: the time of image 000003.png is not later "
                       "than the time of image 000002.png in line 4"))
      << not_after.err;
  EXPECT_EQ(Track({"--set", "source.rate_hz=0", "--set", "source.path=tum/rgb", "--set",
                   "source.max_frames=3"})
                .code,
            0);
  Write("tum/rgb.txt", tum.substr(0, tum.find("1305031455")));
  const Outcome no_time = track("tum/rgb");
  EXPECT_EQ(no_time.code, 65);
  EXPECT_TRUE(Contains(no_time.err, "rgb.txt: there is no time for image 000003.png"))
      << no_time.err;
  Write("kitti/times.txt", kitti + "30\n");
  const Outcome one_more = track("kitti/image_0");
  EXPECT_EQ(one_more.code, 65);
  EXPECT_TRUE(Contains(one_more.err,
                       "times.txt:21: there is a time for image 20, but the source has 20 "
                       "images"))
      << one_more.err;
  Write("kitti/times.txt", "\n");
  EXPECT_TRUE(Contains(track("kitti/image_0").err, "contains no rows"))
      << track("kitti/image_0").err;
}

TEST_F(ImageTracks, ADeviceThatIsNoCameraIsNamed) {
  const Outcome outcome = Track({"--set", "source.path=/dev/null"});
  EXPECT_EQ(outcome.code, 65);
  EXPECT_TRUE(Contains(outcome.err, "/dev/null: OpenCV cannot read this camera")) << outcome.err;
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const Outcome pipe = Track({"--set", "source.path=pipe"});
  EXPECT_EQ(pipe.code, 65);
  EXPECT_TRUE(Contains(pipe.err, "pipe: this is not a regular file")) << pipe.err;
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
  EXPECT_TRUE(Contains(gone.err,
                       "timestamps.csv:20: there is a time for image 19, but the source has 19 "
                       "images"))
      << gone.err;
}

// Missing images late in the sequence are also reported before the first image is processed.
TEST_F(ImageTracks, AllTimesAreCheckedBeforeTheFirstImage) {
  MakeImages();
  Write("config.yaml", kGuided);
  std::filesystem::remove(ImageFile(19));
  std::ostringstream times;
  for (int k = 0; k < 19; ++k) times << (k < 15 ? k : k + 1) << ',' << 0.05 * k << '\n';
  Write("scene/images/timestamps.csv", times.str().substr(0, times.str().rfind("19,")));
  const auto run = [&](testing::Arguments more) {
    more.insert(more.begin(), {"run", "config.yaml", "-o", "run", "--set", "source.rate_hz=0"});
    return Call(more);
  };
  const Outcome outcome = run({});
  EXPECT_EQ(outcome.code, 65);
  EXPECT_TRUE(Contains(outcome.err, "timestamps.csv:16: there is no time for image 15"))
      << outcome.err;
  EXPECT_FALSE(Exists("run"));
  EXPECT_EQ(run({"--set", "source.max_frames=15"}).code, 0);
}

/// Computes the exact measurements of the features that a run tracked in a room. Each feature is
/// the point of the walls that its first observation shows.
class ExactTracks {
 public:
  ExactTracks(Eigen::Vector3d least, Eigen::Vector3d most, std::istream&& truth)
      : least_(std::move(least)), most_(std::move(most)) {
    std::string row;
    for (double t; std::getline(truth, row);) {
      Pose& pose = poses_.emplace_back();
      Eigen::Vector3d& r = pose.r;
      Eigen::Quaterniond& q = pose.q;
      if (std::sscanf(row.c_str(), "%lf %lf %lf %lf %lf %lf %lf %lf", &t, &r[0], &r[1], &r[2],
                      &q.x(), &q.y(), &q.z(), &q.w()) != 8) {
        poses_.pop_back();  // removes the header line of the file
      }
    }
  }

  /// Returns the rows `frame,feature,dim,value` for the features in a run's measurements.csv.
  std::string Rows(std::istream&& measurements, double rate_hz) const {
    std::ostringstream rows("frame,feature,dim,value\n", std::ios::ate);
    rows.precision(17);
    std::map<long, Eigen::Vector3d> points;
    std::string row;
    double t = 0.0, u = 0.0, v = 0.0;
    for (long id = 0; std::getline(measurements, row);) {
      if (std::sscanf(row.c_str(), "%lf,tracks,%ld,%lf,%lf", &t, &id, &u, &v) != 4) continue;
      const std::size_t frame = std::lround(rate_hz * t);
      const Pose& pose = poses_.at(frame);
      if (!points.contains(id))
        points[id] = WallAt(pose, (u - kMiddle[0]) / kF, (v - kMiddle[1]) / kF);
      const Eigen::Vector3d seen = pose.q.conjugate() * (points[id] - pose.r);
      for (const int dim : {0, 1}) {
        rows << frame << ',' << id << ',' << dim << ','
             << kF * seen[dim] / seen[2] + kMiddle[static_cast<std::size_t>(dim)] << '\n';
      }
    }
    return rows.str();
  }

 private:
  static constexpr double kF = 525.0;
  static constexpr std::array<double, 2> kMiddle = {320.0, 240.0};
  struct Pose {
    Eigen::Vector3d r;
    Eigen::Quaterniond q;
  };

  Eigen::Vector3d WallAt(const Pose& pose, double x, double y) const {
    const Eigen::Vector3d along = pose.q * Eigen::Vector3d(x, y, 1.0);
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const double wall = along[i] > 0.0 ? most_[i] : least_[i];
      if (along[i] != 0.0) nearest = std::min(nearest, (wall - pose.r[i]) / along[i]);
    }
    return pose.r + nearest * along;
  }

  Eigen::Vector3d least_, most_;
  std::vector<Pose> poses_;
};

// Runs example 25 from images to the trajectory of the camera. The errors are at most 1.5 times
// those of a run with exact measurements of the same features.
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
  const double seen = rmse_of("source.path=" + (folder_ / "room/images").string());
  const ExactTracks exact({-2.0, -1.3, -1.0}, {2.0, 1.3, 3.5},
                          std::istringstream(Read("room/truth.tum")));
  Write("room/tracks.csv", exact.Rows(std::istringstream(Read("run/measurements.csv")), 30.0));
  const double perfect =
      rmse_of("source={type: tracks, path: " + (folder_ / "room").string() + "}");
  EXPECT_GT(perfect, 0.0003);
  EXPECT_LT(perfect, 0.002);  // both errors are in m
  RecordProperty("seen_and_perfect_m", std::to_string(seen) + ' ' + std::to_string(perfect));
  EXPECT_LT(seen, 1.5 * perfect);
}

constexpr const char* kTurning = R"(alidade: 1
camera: {model: pinhole, width: 320, height: 240, fx: 260, fy: 260, cx: 160, cy: 120}
source:
  type: scene
  max_frames: 20
  rate_hz: 10
  points: {room: {min: [-2, -1.3, -1], max: [2, 1.3, 3.5]}, count: 100}
  surfaces: [{box: {min: [-2, -1.3, -1], max: [2, 1.3, 3.5]}, grain_m: 0.6}]
  trajectory: {look_at: [{position: [-0.2, 0, 0], target: [0, 0, 3]},
                         {position: [-0.1, 0, 0], target: [0.1, 0, 3]},
                         {position: [0.1, 0, 0], target: [0.7, 0, 3]},
                         {position: [0.2, 0.1, 0], target: [2.5, 0, 3]}]}
)";

// The rotation of the camera accelerates. Without a pyramid, optical flow finds motions of only a
// few pixels, but the filter predicts the rotation.
TEST_F(ImageTracks, AreFoundWhereTheFilterExpectsThem) {
  Write("scene.yaml", kTurning);
  Write("config.yaml", kGuided);
  MakeImages();
  const auto followed = [&](const std::string& guide) {
    const Outcome run = Call({"run", "config.yaml", "-o", "run", "--force", "--set",
                              "source.pyramid_levels=0", "--set", "source.guide=" + guide});
    EXPECT_EQ(run.code, 0) << run.err;
    std::map<long, int> images;
    std::istringstream rows(Read("run/measurements.csv"));
    long id = 0;
    for (std::string row; std::getline(rows, row);) {
      if (std::sscanf(row.c_str(), "%*f,tracks,%ld,", &id) == 1) ++images[id];
    }
    EXPECT_FALSE(images.empty());
    double sum = 0.0;
    for (const auto& [feature, count] : images) sum += count;
    return sum / static_cast<double>(images.size());
  };
  const double guided = followed("ekf"), alone = followed("none");
  EXPECT_GT(guided, 2.0 * alone) << "mean number of images per feature: " << guided << " with and "
                                 << alone << " without the filter";
}

/// Predicts each feature at its previous position, with a small covariance. The predictions of the
/// first `count` features are shifted by `by_px`.
class Aside : public Guide {
 public:
  Aside(int count, double by_px) : count_(count), by_px_(by_px) {}
  void Take(const SourceFrame& frame) {
    at_.clear();
    for (const Measurement& m : frame.measurements) at_[m.landmark] = m.values;
  }
  std::vector<ExpectedMeasurement> Expect(int stream, Timestamp,
                                          const std::vector<std::int64_t>& ids) const override {
    EXPECT_EQ(stream, 0);
    std::vector<ExpectedMeasurement> all;
    for (const std::int64_t id : ids) {
      ExpectedMeasurement& one =
          all.emplace_back(ExpectedMeasurement{at_.at(id), {0.25, 0.0, 0.0, 0.25}});
      if (std::ssize(all) <= count_) one.z[1] += by_px_;
    }
    return all;
  }

 private:
  int count_;
  double by_px_;
  std::map<std::int64_t, std::vector<double>> at_;
};

TEST_F(ImageTracks, OutsideTheirEllipseAreLostWhereMostAreWithinIt) {
  Write("config.yaml", kGuided);
  MakeImages();
  for (int k = 1; k < 20; ++k) {
    std::filesystem::copy_file(ImageFile(0), ImageFile(k),
                               std::filesystem::copy_options::overwrite_existing);
  }
  Config config = Config::FromFile((folder_ / "config.yaml").string());
  config.Set("source.path", (folder_ / "scene/images").string(), "test");
  const PluginHost host;
  // If 5 features are outside their predicted regions, these features are lost. If more than half
  // of the features are outside, the prediction is considered wrong and no feature is lost.
  for (const int aside : {0, 5, 1000}) {
    const auto source = CreateSource(host, config, 1);
    Aside guide(aside, 3.0);
    SourceFrame first, second;
    ASSERT_TRUE(source->Next(first));
    ASSERT_GT(first.measurements.size(), 15u);
    guide.Take(first);
    source->SetGuide(&guide);
    ASSERT_TRUE(source->Next(second));
    std::set<std::int64_t> before, kept;
    for (const Measurement& m : first.measurements) before.insert(m.landmark);
    for (const Measurement& m : second.measurements) {
      if (before.contains(m.landmark)) kept.insert(m.landmark);
    }
    EXPECT_EQ(before.size() - kept.size(), aside == 5 ? 5u : 0u) << aside;
  }
}

/// Returns an image that is a sum of waves of 6 to 30 px, shifted by `shift` px. Grey values are
/// not rounded.
cv::Mat Waves(cv::Point2f shift) {
  cv::Mat grey(160, 240, CV_32F, cv::Scalar(128.0));
  cv::RNG random(11);
  for (int wave = 0; wave < 40; ++wave) {
    const double direction = random.uniform(0.0, CV_PI), phase = random.uniform(0.0, 2.0 * CV_PI);
    const double per_px = 2.0 * CV_PI / random.uniform(6.0, 30.0);
    const cv::Point2d per(per_px * std::cos(direction), per_px * std::sin(direction));
    for (int y = 0; y < grey.rows; ++y) {
      for (int x = 0; x < grey.cols; ++x) {
        const double angle = per.dot(cv::Point2d(x, y) - cv::Point2d(shift)) + phase;
        grey.at<float>(y, x) += static_cast<float>(8.0 * std::sin(angle));
      }
    }
  }
  return grey;
}

class EstimatedNoise : public ImageTracks {
 protected:
  void SetUp() override {
    ImageTracks::SetUp();
    Write("config.yaml",
          "alidade: 1\nsource: {type: image_tracks, path: scene/images, rate_hz: 10, features: 40, "
          "estimate_noise: true, sigma_systematic_px: 1e-6}\n");
    std::filesystem::create_directories(folder_ / "scene/images");
  }
  void Draw(int k, const cv::Mat& grey) const {
    cv::Mat image;
    grey.convertTo(image, CV_8U);
    ASSERT_TRUE(cv::imwrite(ImageFile(k), image));
  }
  /// Calls take(first, now) for each feature of the first image and each later image that contains
  /// this feature.
  template <class Take>
  void Follow(const Take& take) const {
    Config config = Config::FromFile((folder_ / "config.yaml").string());
    config.Set("source.path", (folder_ / "scene/images").string(), "test");
    const PluginHost host;
    const auto source = CreateSource(host, config, 1);
    SourceFrame frame;
    ASSERT_TRUE(source->Next(frame));
    std::map<std::int64_t, Measurement> first;
    for (const Measurement& m : frame.measurements) first[m.landmark] = m;
    while (source->Next(frame)) {
      for (const Measurement& m : frame.measurements) {
        if (first.contains(m.landmark)) take(first[m.landmark], m);
      }
    }
  }
};

TEST_F(EstimatedNoise, IsThatOfThePlacesThatAreFound) {
  Draw(0, Waves({}));
  cv::RNG random(3);
  constexpr int kImages = 30;
  for (int k = 1; k <= kImages; ++k) {
    cv::Mat noise(160, 240, CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 6.0);
    Draw(k, Waves({0.3F, -0.4F}) + noise);
  }
  double of_places = 0.0, told = 0.0;
  int count = 0;
  Follow([&](const Measurement& first, const Measurement& now) {
    const double u = now.values[0] - first.values[0] - 0.3;
    const double v = now.values[1] - first.values[1] + 0.4;
    of_places += u * u + v * v;
    ASSERT_EQ(now.covariance.size(), 4u);
    told += now.covariance[0] + now.covariance[3];
    ++count;
  });
  ASSERT_GT(count, 20 * kImages);
  // The variance computed from 600 positions is accurate to 6 %. The variance estimated from 25
  // cells with six fitted parameters is a fifth too small.
  EXPECT_GT(of_places / count, 1e-4);
  EXPECT_NEAR(told / of_places, 0.85, 0.25) << told << " of " << of_places;
}

// The scene has a depth discontinuity: the right half of the image moves by another distance.
TEST_F(EstimatedNoise, IsLargeOfPatchesThatMoveInParts) {
  Draw(0, Waves({}));
  cv::Mat parted = Waves({0.5F, 0.0F});
  Waves({2.0F, 0.0F}).colRange(120, 240).copyTo(parted.colRange(120, 240));
  Draw(1, parted);
  double across = 0.0, beside = 0.0;
  int is_across = 0, is_beside = 0;
  Follow([&](const Measurement& first, const Measurement& now) {
    const double sigma = std::sqrt(now.covariance[0] + now.covariance[3]);
    const double off = std::abs(first.values[0] - 120.0);
    if (off < 8.0) {
      across += sigma;
      ++is_across;
    } else if (off > 15.0) {
      beside += sigma;
      ++is_beside;
    }
  });
  ASSERT_GT(is_across, 1);
  ASSERT_GT(is_beside, 10);
  EXPECT_LT(beside / is_beside, 0.02);
  EXPECT_GT(across / is_across, 4.0 * beside / is_beside);
}

// The predictions have a large error, so they are ignored. All features are found, as they are
// without a filter.
TEST_F(ImageTracks, AreFoundWithoutAGuideThatIsFarOff) {
  Write("config.yaml", kGuided);
  MakeImages();
  std::filesystem::copy_file(ImageFile(0), ImageFile(1),
                             std::filesystem::copy_options::overwrite_existing);
  Config config = Config::FromFile((folder_ / "config.yaml").string());
  config.Set("source.path", (folder_ / "scene/images").string(), "test");
  const PluginHost host;
  const auto source = CreateSource(host, config, 1);
  Aside guide(1000, 200.0);
  SourceFrame first, second;
  ASSERT_TRUE(source->Next(first));
  guide.Take(first);
  source->SetGuide(&guide);
  ASSERT_TRUE(source->Next(second));
  std::set<std::int64_t> kept;
  for (const Measurement& m : second.measurements) kept.insert(m.landmark);
  for (const Measurement& m : first.measurements) EXPECT_TRUE(kept.contains(m.landmark));
}

TEST_F(ImageTracks, AreFollowedInImagesTooSmallForAPyramid) {
  Write("config.yaml",
        "alidade: 1\nsource: {type: image_tracks, path: small, rate_hz: 10, features: 4}\n");
  std::filesystem::create_directories(folder_ / "small");
  for (const int k : {0, 1, 2}) {
    const cv::Mat image = Waves({0.5F * static_cast<float>(k), 0.0F})(cv::Rect(100, 60, 40, 40));
    cv::Mat grey;
    image.convertTo(grey, CV_8U);
    const std::string file = (folder_ / "small" / (std::to_string(k) + ".png")).string();
    ASSERT_TRUE(cv::imwrite(file, grey));
  }
  const Outcome tracked = Track();
  ASSERT_EQ(tracked.code, 0) << tracked.err;
  const ByFrame found = Rows("found/tracks.csv");
  EXPECT_EQ(found.size(), 3u);
  EXPECT_EQ(found.at(2).front().feature, found.at(0).front().feature);
}

TEST_F(ImageTracks, ThatBringTheirNoiseAreTakenByTheFilter) {
  Write("config.yaml", kGuided);
  MakeImages();
  const Outcome run =
      Call({"run", "config.yaml", "-o", "run", "--set", "source.estimate_noise=true"});
  ASSERT_EQ(run.code, 0) << run.err;
  const std::string json = Read("run/run.json");
  EXPECT_TRUE(Contains(json, "\"accepted:pixels\"")) << json;
  EXPECT_FALSE(Contains(json, "\"invalid:pixels\"")) << json;
}

TEST_F(ImageTracks, AreGuidedInAComparisonToo) {
  Write("config.yaml", kGuided);
  MakeImages();
  const Outcome compared =
      Call({"compare", "config.yaml", "--no-decomposition", "--set", "estimators.iekf={type: iekf}",
            "--set", "source.max_frames=5", "--reference", "iekf", "-o", "compared"});
  EXPECT_EQ(compared.code, 0) << compared.err;
}

TEST_F(ImageTracks, ThatAFilterGuidesAreGivenWithoutItToo) {
  Write("config.yaml", kGuided);
  MakeImages();
  EXPECT_EQ(Track().code, 0);
  EXPECT_EQ(Rows("found/tracks.csv").size(), 20u);
}

TEST_F(ImageTracks, AGuideIsAFilterOfTheConfig) {
  Write("config.yaml", kGuided);
  MakeImages();
  const Outcome unknown = Call({"run", "config.yaml", "--set", "source.guide=ekff"});
  EXPECT_EQ(unknown.code, 78);
  EXPECT_TRUE(Contains(unknown.err, "source.guide: estimator 'ekff' does not exist"))
      << unknown.err;
  EXPECT_TRUE(Contains(unknown.err, "did you mean 'ekf'")) << unknown.err;
  const Outcome held = Call({"run", "config.yaml", "--set", "out_of_sequence={policy: buffer}"});
  EXPECT_EQ(held.code, 78);
  EXPECT_TRUE(Contains(held.err, "before the source measures the next")) << held.err;
  const Outcome blind = Call({"run", "config.yaml", "--set", "sensors.pixels.stream=other"});
  EXPECT_EQ(blind.code, 78) << blind.err;
  const Outcome batch = Call({"run", "config.yaml", "--set", "estimators.ekf={type: ceres_batch}"});
  EXPECT_EQ(batch.code, 78);
  EXPECT_TRUE(Contains(batch.err, "estimator 'ekf' (ceres_batch) cannot predict measurements"))
      << batch.err;
  EXPECT_TRUE(Contains(batch.err, "expected a recursive filter; add one to `estimators`"))
      << batch.err;
  const Outcome other = Call({"run", "config.yaml", "--set", "estimators.all={type: ceres_batch}",
                              "--set", "source.guide=all"});
  EXPECT_EQ(other.code, 78);
  EXPECT_TRUE(Contains(other.err, "expected a recursive filter of `estimators`: ekf")) << other.err;
}

TEST_F(ImageTracks, ExplainSaysWhoGuidesAndWhoseTheNoiseIs) {
  Write("config.yaml", kGuided);
  MakeImages();
  const Outcome explained = Call({"explain", "config.yaml", "--set", "source.estimate_noise=true"});
  EXPECT_EQ(explained.code, 0) << explained.err;
  EXPECT_TRUE(Contains(explained.out, "guide: filter 'ekf' predicts the search regions"))
      << explained.out;
  EXPECT_TRUE(Contains(explained.out, "estimate_noise  true")) << explained.out;
  const Outcome alone = Call({"explain", "config.yaml", "--set", "source.guide=none"});
  EXPECT_FALSE(Contains(alone.out, "guide: filter")) << alone.out;
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
  // The camera starts at the origin and looks along z, so the depth of a point is its z.
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
  const auto drawn = Rows("scene/tracks.csv");
  for (const Seen& one : drawn.at(0)) {
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
    testing::Arguments arguments{"run", "config.yaml", "-o", "run", "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome run = Call(arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    const Outcome eval = Call({"eval", "scene/truth.tum", "run", "--align-mode", "sim3", "--json"});
    EXPECT_EQ(eval.code, 0) << eval.err;
    const std::size_t at = eval.out.find("\"scale\":");
    return at == std::string::npos ? NAN : std::stod(eval.out.substr(at + 8));
  };
  EXPECT_NEAR(scale({}), 1.0, 0.03);
  // If all known depths are halved, the map is half as large.
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
  EXPECT_TRUE(Contains(rim.err, "known.csv:2: the point is outside the image")) << rim.err;
}

// Example 29: the target on the desk of MonoSLAM is 0.21 m wide and 0.1485 m high.
TEST_F(ImageTracks, AKnownTargetGivesARecordedDeskItsScale) {
  const char* const data = std::getenv("ALIDADE_DATA");
  const std::filesystem::path frames =
      std::filesystem::path(data == nullptr ? "" : data) / "mono-davison-desk/frames";
  if (data == nullptr || !std::filesystem::exists(frames)) {
    GTEST_SKIP() << "ALIDADE_DATA does not contain mono-davison-desk";
  }
  const std::string example =
      std::string(ALIDADE_SOURCE_DIR) + "/examples/29_slam_recorded_images/config.yaml";
  const Outcome run =
      Call({"run", example, "--set", "source.path=" + frames.string(), "-o", "run"});
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
