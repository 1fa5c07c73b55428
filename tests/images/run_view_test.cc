// SPDX-License-Identifier: Apache-2.0
//
// Tests `alidade run --save-video`: the contents of the video, and the cases in which the program
// refuses to write it.
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

// The scene has four points on a textured plate 4 m ahead. The camera moves sideways from x = 0 to
// 0.3 m. It sees the point (X, Y) at u = 159.5 + 250 (X - x) / 4, v = 119.5 + 250 Y / 4.
const std::string kPlate = R"(alidade: 1
title: A plate
camera: {model: pinhole, width: 320, height: 240, fx: 250, fy: 250, cx: 159.5, cy: 119.5}
state:
  cam:
    model: quaternion_pose
    noise: {kind: continuous, linear_acceleration: 0.1, angular_acceleration: 0.05}
    initial:
      position: {mean: [0, 0, 0], sigma: 0}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0}
      velocity: {mean: [0, 0, 0], sigma: 0.5}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.3}
landmarks: {representation: inverse_depth, prior: {inverse_distance: 0.25, sigma: 0.1}}
sensors:
  pixels: {model: inverse_depth_feature, stream: tracks, sigma_px: 2.0,
           roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}}
source:
  type: scene
  max_frames: 8
  rate_hz: 10
  sigma_px: 0
  points: {list: [[-1, -0.6, 4], [1, -0.6, 4], [-1, 0.6, 4], [1, 0.6, 4]]}
  surfaces: [{rectangle: {corner: [-3, -3, 4], right: [6, 0, 0], down: [0, 6, 0]}}]
  trajectory: {look_at: [{position: [0, 0, 0], target: [0, 0, 4]},
                         {position: [0.3, 0, 0], target: [0.3, 0, 4]}]}
estimators: {ekf: {type: ekf}}
)";
// The video shows the image of 320 x 240 px, enlarged three times, next to the panel.
constexpr int kTimes = 3, kWidth = 320 * kTimes + 400, kHeight = 240 * kTimes;

class RunView : public testing::ProgramTest {
 protected:
  Outcome Run(const std::string& config, testing::Arguments more) {
    Write("plate.yaml", config);
    more.insert(more.begin(), {"run", "plate.yaml", "-o", "run"});
    return Call(more);
  }
  std::vector<cv::Mat> Frames(const std::string& name) const {
    cv::VideoCapture video((folder_ / name).string(), cv::CAP_OPENCV_MJPEG);
    std::vector<cv::Mat> frames;
    for (cv::Mat frame; video.read(frame);) frames.push_back(frame.clone());
    return frames;
  }
  /// Returns the mean blue, green and red of the 3 x 3 pixels around pixel (u, v) of the source's
  /// image.
  static cv::Scalar ColourAt(const cv::Mat& frame, double u, double v) {
    const int x = cvRound(kTimes * (u + 0.5) - 0.5), y = cvRound(kTimes * (v + 0.5) - 0.5);
    return cv::mean(frame(cv::Rect(x - 1, y - 1, 3, 3)));
  }
  /// Returns true if the channel 0, 1 or 2 (blue, green, red) is clearly brighter than the other
  /// two channels.
  static bool Is(const cv::Scalar& colour, int channel) {
    for (int other = 0; other < 3; ++other) {
      if (other != channel && colour[channel] < colour[other] + 50.0) return false;
    }
    return true;
  }
};

// Pixels in the first frame: u = 159.5 + 250 X / 4, v = 119.5 + 250 Y / 4.
constexpr std::array<double, 2> kFirst[] = {{97, 82}, {222, 82}, {97, 157}, {222, 157}};

TEST_F(RunView, TheVideoHasEachFrameAndItsFeaturesInTheirColours) {
  const Outcome outcome = Run(kPlate, {"--save-video", "plate.avi"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Contains(outcome.out, "video    plate.avi\n")) << outcome.out;
  const std::vector<cv::Mat> frames = Frames("plate.avi");
  ASSERT_EQ(frames.size(), 8u);
  for (const cv::Mat& frame : frames) EXPECT_EQ(frame.size(), cv::Size(kWidth, kHeight));
  const cv::VideoCapture video((folder_ / "plate.avi").string(), cv::CAP_OPENCV_MJPEG);
  EXPECT_EQ(video.get(cv::CAP_PROP_FPS), 10.0);
  // Each frame is complete: even the last block of the panel has the grey of the panel. The default
  // video reader of OpenCV also finds all frames.
  for (const cv::Mat& frame : frames) {
    const cv::Scalar last = cv::mean(frame(cv::Rect(kWidth - 8, kHeight - 8, 8, 8)));
    for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(last[channel], 27.0, 6.0);
  }
  cv::VideoCapture other((folder_ / "plate.avi").string());
  int count = 0;
  for (cv::Mat frame; other.read(frame);) ++count;
  EXPECT_EQ(count, 8) << other.getBackendName();
  for (const auto& [u, v] : kFirst) {
    // New features are blue.
    EXPECT_TRUE(Is(ColourAt(frames[0], u, v), 0)) << ColourAt(frames[0], u, v);
    EXPECT_FALSE(Is(ColourAt(frames[0], u + 20.0, v), 0));
  }
  // The camera moves 0.3 m in 7 intervals, and 1 m moves a point by 250 / 4 px. Features accepted
  // from the second frame on are green.
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const double moved = 0.3 / 7.0 * static_cast<double>(k) * 250.0 / 4.0;
    for (const auto& [u, v] : kFirst) {
      const cv::Scalar colour = ColourAt(frames[k], u - moved, v);
      EXPECT_TRUE(Is(colour, 1)) << "frame " << k << ": " << colour;
    }
  }
}

TEST_F(RunView, RejectedFeaturesAreRed) {
  ASSERT_EQ(Run(kPlate, {"--save-video", "p.avi", "--set", "estimators.ekf.gate=1e-9"}).code, 0);
  const std::vector<cv::Mat> frames = Frames("p.avi");
  ASSERT_EQ(frames.size(), 8u);
  const double moved = 0.3 / 7.0 * 250.0 / 4.0;
  for (const auto& [u, v] : kFirst) {
    const cv::Scalar colour = ColourAt(frames[1], u - moved, v);
    EXPECT_TRUE(Is(colour, 2)) << colour;
  }
}

// The video shows the 3-sigma ellipse of the innovation. R alone makes the ellipse at least 6 px
// large, and S makes the ellipse larger.
TEST_F(RunView, TheInnovationHasItsEllipse) {
  ASSERT_EQ(Run(kPlate, {"--save-video", "p.avi"}).code, 0);
  const cv::Mat frame = Frames("p.avi").at(4);
  const double moved = 0.3 / 7.0 * 4.0 * 250.0 / 4.0;
  const double u = kFirst[0][0] - moved, v = kFirst[0][1];
  int ring = 0, inside = 0;
  for (int y = -60; y <= 60; ++y) {
    for (int x = -60; x <= 60; ++x) {
      const cv::Scalar colour =
          frame.at<cv::Vec3b>(cvRound(kTimes * (v + 0.5)) + y, cvRound(kTimes * (u + 0.5)) + x);
      const double away = std::hypot(x, y) / kTimes;  // distance in px of the source's image
      if (!Is(colour, 1)) continue;
      if (away > 5.5 && away < 12.0) ++ring;
      if (away > 2.5 && away < 5.0 && std::abs(y) > 4) ++inside;  // the test of y excludes the tail
    }
  }
  EXPECT_GT(ring, 60);
  EXPECT_EQ(inside, 0);
}

TEST_F(RunView, ChangesNothingOfTheRun) {
  ASSERT_EQ(Run(kPlate, {}).code, 0);
  const std::string estimates = Read("run/ekf/estimates.csv");
  const std::string innovations = Read("run/ekf/innovations.csv");
  const std::string inputs = Read("run/inputs.json");
  ASSERT_EQ(Run(kPlate, {"--save-video", "plate.avi", "--force"}).code, 0);
  EXPECT_EQ(Read("run/ekf/estimates.csv"), estimates);
  EXPECT_EQ(Read("run/ekf/innovations.csv"), innovations);
  EXPECT_EQ(Read("run/inputs.json"), inputs);
}

TEST_F(RunView, ShowsTheImagesThatFeaturesWereFoundIn) {
  Write("scene.yaml", kPlate);
  ASSERT_EQ(Call({"simulate", "scene.yaml", "-o", "data", "--images", "images"}).code, 0);
  const std::string found = kPlate.substr(0, kPlate.find("source:")) +
                            "source: {type: image_tracks, path: data/images, rate_hz: 10}\n"
                            "estimators: {ekf: {type: ekf}}\n";
  const Outcome outcome = Run(found, {"--save-video", "found.avi"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::vector<cv::Mat> frames = Frames("found.avi");
  ASSERT_EQ(frames.size(), 8u);
  // The bound is three times the number of green pixels of rings without a feature.
  cv::Mat channels[3];
  cv::split(frames[5](cv::Rect(0, 0, 320 * kTimes, kHeight)), channels);
  const cv::Mat green = channels[1] > channels[0] + 60;
  EXPECT_GT(cv::countNonZero(green), 1000);
}

// In the first image the target is 90 px wide and starts at (75, 45). The outline is drawn 3.5 px
// inside the edges of the target.
TEST_F(RunView, ShowsTheOutlineOfATarget) {
  Write("scene.yaml", R"(alidade: 1
source:
  type: depth_target
  seed: 3
  duration_s: 0.3
  rate_hz: 20
  focal_px: 120
  frequency_hz: 1
  template_px: 90
  image: {width: 240, height: 180, noise_grey: 1}
)");
  ASSERT_EQ(Call({"simulate", "scene.yaml", "-o", "pair", "--images", "images"}).code, 0);
  std::string config = testing::kDepthConfig;
  config.replace(config.find("source:"), config.find("estimators:") - config.find("source:"),
                 "source: {type: stereo_target, left: pair/images/left, right: pair/images/right,\n"
                 "         timestamps: pair/timestamps.csv, target: [75, 45, 90, 90]}\n");
  config.replace(config.find("focal_px: 400"), 13, "focal_px: 120");
  const Outcome outcome = Run(config, {"--save-video", "target.avi"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::vector<cv::Mat> frames = Frames("target.avi");
  ASSERT_EQ(frames.size(), 7u);
  ASSERT_EQ(frames[0].size(), cv::Size(4 * 240 + 400, 720));
  const auto green_columns = [&](int from, int to) {  // counts in the middle row
    int count = 0;
    for (int x = from; x < to; ++x) {
      const cv::Vec3b at = frames[0].at<cv::Vec3b>(360, x);
      if (at[1] > at[0] + 50 && at[1] > at[2] + 50) ++count;
    }
    return count;
  };
  const int left = 4 * 75 + 14, right = 4 * 165 - 14;
  EXPECT_GE(green_columns(left - 8, left + 8), 1);
  EXPECT_GE(green_columns(right - 8, right + 8), 1);
  EXPECT_EQ(green_columns(left + 9, right - 9), 0);
  EXPECT_EQ(green_columns(0, left - 9), 0);
}

TEST_F(RunView, RefusesWhatItCannotShow) {
  Write("table.csv", "t_s,d\n0,80\n1,81\n");
  const Outcome blind = Call({"run", "table.yaml", "-o", "run", "--save-video", "v.avi"});
  EXPECT_EQ(blind.code, 78);
  EXPECT_TRUE(
      Contains(blind.err,
               "source: the source has no images to show; expected a source that reads images, "
               "or draws images from `surfaces`"))
      << blind.err;
  EXPECT_FALSE(Exists("run"));
  EXPECT_FALSE(Exists("v.avi"));

  const Outcome buffered = Run(kPlate, {"--save-video", "v.avi", "--set",
                                        "out_of_sequence={policy: buffer, window_s: 0.1}"});
  EXPECT_EQ(buffered.code, 78);
  EXPECT_TRUE(Contains(buffered.err, "out_of_sequence.policy: this policy reorders frames"))
      << buffered.err;
}

TEST_F(RunView, RefusesWhatItCannotWrite) {
  const Outcome other = Run(kPlate, {"--save-video", "video.mp4"});
  EXPECT_EQ(other.code, 2);
  EXPECT_TRUE(Contains(other.err, "expected a name such as video.avi")) << other.err;

  const Outcome nowhere = Run(kPlate, {"--save-video", "none/v.avi"});
  EXPECT_EQ(nowhere.code, 73);
  EXPECT_TRUE(Contains(nowhere.err, "none/v.partial.avi: ")) << nowhere.err;

  Write("v.avi", "mine");
  const Outcome there = Run(kPlate, {"--save-video", "v.avi"});
  EXPECT_EQ(there.code, 73);
  EXPECT_TRUE(Contains(there.err, "v.avi: the file exists; --force replaces it")) << there.err;
  EXPECT_EQ(Read("v.avi"), "mine");
  EXPECT_FALSE(Exists("run"));
  EXPECT_EQ(Run(kPlate, {"--save-video", "v.avi", "--force"}).code, 0);
  EXPECT_EQ(Frames("v.avi").size(), 8u);
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    EXPECT_FALSE(Contains(entry.path().filename().string(), "partial")) << entry.path();
  }
}

TEST_F(RunView, AWindowNeedsADisplay) {
  ::unsetenv("DISPLAY");
  ::unsetenv("WAYLAND_DISPLAY");
  const Outcome outcome = Run(kPlate, {"--view"});
  EXPECT_EQ(outcome.code, 73);
  EXPECT_TRUE(Contains(outcome.err,
                       "--view: there is no display, because DISPLAY is not set; expected a "
                       "graphical session; --save-video FILE.avi does not need a display"))
      << outcome.err;
  EXPECT_FALSE(Exists("run"));

  ::setenv("DISPLAY", ":4711", 1);  // no X server has this number
  const Outcome nobody = Run(kPlate, {"--view"});
  ::unsetenv("DISPLAY");
  EXPECT_EQ(nobody.code, 73) << nobody.err;
  EXPECT_TRUE(Contains(nobody.err, "--view: the window cannot be opened")) << nobody.err;
  EXPECT_FALSE(Exists("run"));
}

}  // namespace
}  // namespace alidade
