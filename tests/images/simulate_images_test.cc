// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

// The lens distortion moves the corners of the image inwards by about 40 px.
const std::string kScene = R"(alidade: 1
camera: {model: radtan, width: 320, height: 240, fx: 260, fy: 265, cx: 160.5, cy: 119,
         k1: -0.25, k2: 0.05, p1: 0.001, p2: -0.002}
source:
  type: scene
  seed: 5
  max_frames: 6
  rate_hz: 20
  sigma_px: 0.7
  known_points: {count: 3}
  points: {box: {min: [-3, -2, 2], max: [3, 2, 6]}, count: 30}
  trajectory: {look_at: [{position: [-0.5, 0, 0], target: [0, 0, 4]},
                         {position: [0.5, 0, 0], target: [0, 0, 4]}]}
)";

using Pixel = std::array<double, 2>;
using Pixels = std::map<int, std::map<int, Pixel>>;  ///< pixel of each feature in each frame

class SimulateImages : public testing::ProgramTest {
 protected:
  Outcome Simulate(const std::string& config, testing::Arguments more) {
    Write("scene.yaml", config);
    more.insert(more.begin(), {"simulate", "scene.yaml", "-o", "data"});
    return Call(more);
  }

  /// Reads the pixels from a file with rows `frame,feature,dim,value` into `pixels`.
  void Read(const std::string& name, Pixels& pixels) const {
    std::istringstream rows(ProgramTest::Read(name));
    std::string row;
    std::getline(rows, row);
    while (std::getline(rows, row)) {
      int frame = 0, feature = 0, dim = 0;
      double value = 0.0;
      ASSERT_EQ(std::sscanf(row.c_str(), "%d,%d,%d,%lf", &frame, &feature, &dim, &value), 4);
      if (dim < 2) pixels[frame][feature][static_cast<std::size_t>(dim)] = value;
    }
  }
  Pixels AllPixels() const {
    Pixels pixels;
    Read("data/tracks.csv", pixels);
    Read("data/known.csv", pixels);
    return pixels;
  }
  cv::Mat Image(const std::string& name) const {
    return cv::imread((folder_ / name).string(), cv::IMREAD_GRAYSCALE);
  }

  std::vector<cv::Mat> Frames(const std::string& name) const {
    cv::VideoCapture video((folder_ / name).string(), cv::CAP_OPENCV_MJPEG);
    std::vector<cv::Mat> frames;
    for (cv::Mat frame; video.read(frame);) {
      frames.emplace_back();
      cv::cvtColor(frame, frames.back(), cv::COLOR_BGR2GRAY);
    }
    return frames;
  }
};

// kRadius is in px. The grey value of the drawn frame number is below kDark.
constexpr double kRadius = 4.0, kDark = 60.0;

/// Returns the largest distance, in px, between the centroid of a disc and its point. Discs that
/// touch another disc or the border are skipped; `count` counts the others.
double LargestError(const cv::Mat& image, const std::map<int, Pixel>& points, int& count) {
  double largest = 0.0;
  for (const auto& [feature, p] : points) {
    constexpr double kReach = kRadius + 3.0;
    bool alone = p[0] > kReach && p[1] > kReach && p[0] < image.cols - 1 - kReach &&
                 p[1] < image.rows - 1 - kReach;
    for (const auto& [other, q] : points) {
      alone &= other == feature || std::hypot(p[0] - q[0], p[1] - q[1]) > 2.0 * kReach;
    }
    if (!alone) continue;
    double sum = 0.0, u = 0.0, v = 0.0;
    for (int y = static_cast<int>(p[1] - kReach); y <= p[1] + kReach; ++y) {
      for (int x = static_cast<int>(p[0] - kReach); x <= p[0] + kReach; ++x) {
        const double bright = std::max(0.0, image.at<unsigned char>(y, x) - kDark);
        sum += bright;
        u += bright * x;
        v += bright * y;
      }
    }
    ++count;
    EXPECT_GT(sum, 0.0) << "feature " << feature;
    if (sum > 0.0) largest = std::max(largest, std::hypot(u / sum - p[0], v / sum - p[1]));
  }
  return largest;
}

TEST_F(SimulateImages, DiscsLieWhereTheTracksSay) {
  const Outcome made = Simulate(kScene, {"--video", "video.avi", "--images", "images"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(Contains(made.out, "data/video.avi\n")) << made.out;
  EXPECT_TRUE(Contains(made.out, "data/images\n")) << made.out;
  const Pixels pixels = AllPixels();
  const std::vector<cv::Mat> frames = Frames("data/video.avi");
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_FALSE(Exists("data/images/000006.png"));
  int seen = 0, seen_again = 0;
  for (int k = 0; k < 6; ++k) {
    const cv::Mat image = Image("data/images/00000" + std::to_string(k) + ".png");
    ASSERT_EQ(image.size(), cv::Size(320, 240));
    ASSERT_EQ(frames[static_cast<std::size_t>(k)].size(), cv::Size(320, 240));
    // OpenCV draws smoothed discs. For each of 16 x 16 sub-pixel positions the centroid is within
    // 0.06 px of the centre. JPEG compression increases the error.
    EXPECT_LT(LargestError(image, pixels.at(k), seen), 0.1) << "frame " << k;
    const cv::Mat& frame = frames[static_cast<std::size_t>(k)];
    EXPECT_LT(LargestError(frame, pixels.at(k), seen_again), 0.5) << "frame " << k;
  }
  EXPECT_GT(seen, 60);
  EXPECT_EQ(seen, seen_again);
}

TEST_F(SimulateImages, AreAllAlikeAndOfNothingElse) {
  ASSERT_EQ(Simulate(kScene, {"--images", "images"}).code, 0);
  const Pixels pixels = AllPixels();
  const cv::Mat image = Image("data/images/000000.png");
  // The sum of the grey values of all discs lies between zero and the sum for separate discs. A
  // separate disc has an area of pi r^2 with the value 255.
  const double total = cv::sum(cv::max(image, static_cast<int>(kDark)) - kDark)[0];
  const double one = M_PI * (kRadius + 0.5) * (kRadius + 0.5) * (255.0 - kDark);
  const auto count = static_cast<double>(pixels.at(0).size());
  EXPECT_LT(total, 1.1 * count * one);
  // Some discs touch each other, or are cut by the border.
  EXPECT_GT(total, 0.7 * count * one);
}

TEST_F(SimulateImages, TheVideoHasTheRateOfTheSource) {
  ASSERT_EQ(Simulate(kScene, {"--video", "film/of scene.avi"}).code, 0);
  const cv::VideoCapture video((folder_ / "data/film/of scene.avi").string(), cv::CAP_OPENCV_MJPEG);
  EXPECT_EQ(video.get(cv::CAP_PROP_FPS), 20.0);
  EXPECT_TRUE(Contains(ProgramTest::Read("data/files.txt"), "film/of scene.avi\n"));
}

TEST_F(SimulateImages, OneFrameIsAVideoToo) {
  ASSERT_EQ(Simulate(kScene, {"--video", "v.avi", "--set", "source.max_frames=1"}).code, 0);
  EXPECT_EQ(Frames("data/v.avi").size(), 1u);
}

TEST_F(SimulateImages, RefusesWhatItCannotWrite) {
  const Outcome other = Simulate(kScene, {"--video", "video.mp4"});
  EXPECT_EQ(other.code, 2);
  EXPECT_TRUE(Contains(other.err, "expected a name such as video.avi")) << other.err;
  const Outcome outside = Simulate(kScene, {"--images", "../images"});
  EXPECT_EQ(outside.code, 77) << outside.err;
  EXPECT_TRUE(Contains(outside.err,
                       "--images: '../images' is outside the output folder; expected a "
                       "relative path inside this folder"))
      << outside.err;
  EXPECT_EQ(Simulate(kScene, {"--video", "/tmp/v.avi"}).code, 77);
  Write("table.yaml", testing::kTableConfig);
  Write("table.csv", "t_s,d\n0,80\n");
  const Outcome blind = Call({"simulate", "table.yaml", "-o", "data", "--video", "v.avi"});
  EXPECT_EQ(blind.code, 78);
  EXPECT_TRUE(Contains(blind.err, "camera: missing key, needed by images of a simulation"))
      << blind.err;
  EXPECT_FALSE(Exists("data"));
}

TEST_F(SimulateImages, SurfacesAreSeenWhereTheyAre) {
  // The plate is 1 m wide and 0.5 m high and is 2 m ahead. A pinhole camera sees its edges at known
  // pixels.
  const Outcome outcome = Simulate(R"(alidade: 1
camera: {model: pinhole, width: 160, height: 120, fx: 100, fy: 100, cx: 80, cy: 60,
         baseline_m: 0.4}
source:
  type: scene
  max_frames: 2
  measures: stereo
  image_noise_grey: 0
  points: {list: [[0, 0, 2]]}
  surfaces: [{rectangle: {corner: [-0.5, -0.25, 2], right: [1, 0, 0], down: [0, 0.5, 0]}}]
  trajectory: {look_at: [{position: [0, 0, 0], target: [0, 0, 1]},
                         {position: [0, 0, 1], target: [0, 0, 2]}]}
)",
                                   {"--images", "images"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto edges = [&](const char* name) {
    const cv::Mat image = cv::imread((folder_ / name).string(), cv::IMREAD_GRAYSCALE);
    return cv::boundingRect(image);
  };
  EXPECT_EQ(edges("data/images/left/000000.png"), cv::Rect(55, 48, 51, 25));
  EXPECT_EQ(edges("data/images/right/000000.png"), cv::Rect(35, 48, 51, 25));
  EXPECT_EQ(edges("data/images/left/000001.png"), cv::Rect(30, 35, 101, 51));
  EXPECT_EQ(edges("data/images/right/000001.png"), cv::Rect(0, 35, 91, 51));
}

TEST_F(SimulateImages, TheNearerSurfaceHidesTheOther) {
  const auto draw = [&](const char* surfaces, const char* folder) {
    Write("scene.yaml", std::string(R"(alidade: 1
camera: {model: pinhole, width: 80, height: 60, fx: 60, fy: 60, cx: 40, cy: 30}
source:
  type: scene
  max_frames: 1
  image_noise_grey: 0
  points: {list: [[0, 0, 2]]}
  trajectory: {look_at: [{position: [0, 0, 0], target: [0, 0, 1]}]}
  surfaces: )") + surfaces + '\n');
    const Outcome outcome = Call({"simulate", "scene.yaml", "-o", folder, "--images", "images"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return cv::imread((folder_ / folder / "images/000000.png").string(), cv::IMREAD_GRAYSCALE);
  };
  // Textures are assigned in the order of the list. A rectangle that is out of view replaces the
  // wall, so the textures of the other surfaces do not change.
  const char* const kAway = "{rectangle: {corner: [0, 0, -5], right: [1, 0, 0], down: [0, 1, 0]}}";
  const std::string wall =
      "{rectangle: {corner: [-5, -5, 4], right: [10, 0, 0], down: [0, 10, 0]}}";
  const std::string plate =
      "{rectangle: {corner: [-0.3, -0.3, 1], right: [0.6, 0, 0], down: [0, 0.6, 0]}}";
  const std::string both = "[" + wall + ", " + plate + "]";
  const std::string alone = std::string("[") + kAway + ", " + plate + "]";
  const cv::Mat scene = draw(both.c_str(), "both"), one = draw(alone.c_str(), "one");
  const cv::Rect inside(24, 14, 33, 33);
  EXPECT_EQ(cv::norm(scene(inside), one(inside), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::boundingRect(one), cv::Rect(22, 12, 37, 37));
  EXPECT_GT(cv::countNonZero(scene), 80 * 60 * 9 / 10);
}

// Blocks have 512 bytes. Each file except the video fits into 16 blocks. An image needs more than 2
// blocks.
TEST_F(SimulateImages, AFullDiskIsAnError) {
  before_ = "ulimit -f 16";
  const Outcome video = Simulate(kScene, {"--video", "v.avi"});
  EXPECT_EQ(video.code, 74) << video.err;
  EXPECT_TRUE(Contains(video.err, "data.partial/v.avi: the video cannot be written")) << video.err;
  before_ = "ulimit -f 2";
  const Outcome images = Simulate(kScene, {"--images", "images"});
  EXPECT_EQ(images.code, 74) << images.err;
  EXPECT_TRUE(Contains(images.err, "data.partial/images/000000.png: the file cannot be written"))
      << images.err;
  EXPECT_FALSE(Exists("data"));
}

}  // namespace
}  // namespace alidade
