// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <vector>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

constexpr const char* kPair = R"(alidade: 1
source:
  type: depth_target
  seed: 3
  duration_s: 1
  rate_hz: 20
  focal_px: 120
  frequency_hz: 1
  template_px: 90
  image: {width: 240, height: 180, noise_grey: 1}
)";

constexpr const char* kTarget = R"(alidade: 1
source:
  type: stereo_target
  left: pair/images/left
  right: pair/images/right
  timestamps: pair/timestamps.csv
  truth: pair/truth.csv
  target: [75, 45, 90, 90]
)";

/// Values of a stream without landmarks, keyed by frame.
using Values = std::map<int, double>;

class StereoTarget : public testing::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    Write("pair.yaml", kPair);
    Write("config.yaml", kTarget);
  }
  void MakePair() {
    const Outcome made = Call({"simulate", "pair.yaml", "-o", "pair", "--images", "images"});
    ASSERT_EQ(made.code, 0) << made.err;
  }
  Outcome Measure(testing::Arguments more = {}) {
    more.insert(more.begin(), {"simulate", "config.yaml", "-o", "found", "--force"});
    return Call(more);
  }
  Values Column(const std::string& file, std::size_t column) const {
    Values values;
    std::istringstream rows(Read(file));
    std::string row, cell;
    std::getline(rows, row);
    for (int line = 0; std::getline(rows, row); ++line) {
      std::istringstream cells(row);
      std::vector<std::string> all;
      while (std::getline(cells, cell, ',')) all.push_back(cell);
      values[column == 0 || file == "pair/truth.csv" ? line : std::stoi(all[0])] =
          std::stod(all[column]);
    }
    return values;
  }
  Values Found(const std::string& stream) const {
    return std::filesystem::exists(folder_ / ("found/" + stream + ".csv"))
               ? Column("found/" + stream + ".csv", 2)
               : Values{};
  }
  Values Depth() const { return Column("pair/truth.csv", 1); }
  std::string Image(const std::string& side, int k) const {
    char name[64];
    std::snprintf(name, sizeof name, "pair/images/%s/%06d.png", side.c_str(), k);
    return (folder_ / name).string();
  }
  void Change(int k, const std::function<void(cv::Mat&)>& change) const {
    for (const char* side : {"left", "right"}) {
      cv::Mat image = cv::imread(Image(side, k), cv::IMREAD_GRAYSCALE);
      change(image);
      ASSERT_TRUE(cv::imwrite(Image(side, k), image));
    }
  }
};

TEST_F(StereoTarget, DisparityAndScaleAreThoseOfTheDepth) {
  MakePair();
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Values depth = Depth(), disparity = Found("disparity"), scale = Found("inverse_scale");
  ASSERT_EQ(depth.size(), 21u);
  EXPECT_EQ(disparity.size(), 21u);
  ASSERT_EQ(scale.size(), 21u);
  for (const auto& [frame, value] : disparity) {
    EXPECT_NEAR(value, 120.0 * 0.065 / depth.at(frame), 0.05) << frame;
  }
  for (const auto& [frame, value] : scale) {
    EXPECT_NEAR(value, depth.at(frame) / depth.at(0), 2.5e-3 * value) << frame;
  }
}

TEST_F(StereoTarget, NearerThanTheSearchedDisparitiesStereoIsBlindAndScaleIsNot) {
  MakePair();
  ASSERT_EQ(Measure({"--set", "source.disparity.max_px=26"}).code, 0);
  const Values depth = Depth(), disparity = Found("disparity");
  EXPECT_EQ(Found("inverse_scale").size(), 21u);
  int seen = 0;
  for (const auto& [frame, z] : depth) {
    const double px = 120.0 * 0.065 / z;
    if (std::abs(px - 26.0) < 0.1) continue;
    EXPECT_EQ(disparity.contains(frame), px < 26.0) << frame;
    seen += px < 26.0;
  }
  EXPECT_GT(seen, 5);
  EXPECT_LT(seen, 16);
}

TEST_F(StereoTarget, MeasurementsBringTheirVariances) {
  MakePair();
  Write("run.yaml", std::string(kTarget) + R"(state:
  target:
    model: constant_velocity
    blocks: {position: depth, velocity: depth_rate}
    noise: {kind: discrete, acceleration: 5.0}
    initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {mean: 0, sigma: 1}}
sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 120, baseline_m: 0.065, sigma_px: 50}
estimators: {ekf: {type: ekf}}
)");
  // The sensor entry has a sigma of 50 px. If the variances of the measurements were ignored,
  // disparity would hardly change the depth.
  const auto rmse_mm = [&](const char* estimate) {
    const Outcome outcome = Call({"run", "run.yaml", "-o", "run", "--force", "--set",
                                  std::string("source.estimate_noise=") + estimate});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const std::string table = Read("run/comparison.csv");
    const std::string key = "rmse:target.depth,";
    const std::size_t at = table.find(key);
    EXPECT_NE(at, table.npos);
    return 1e3 * std::stod(table.substr(at + key.size()));
  };
  EXPECT_LT(rmse_mm("true"), 1.0);
  EXPECT_GT(rmse_mm("false"), 5.0);
}

TEST_F(StereoTarget, HiddenBlackAndFrozenImagesGiveNothingFalse) {
  MakePair();
  // Three images are black. One image is dimmer, which has no effect. One image repeats the
  // previous image.
  for (const int k : {5, 6, 7}) Change(k, [](cv::Mat& image) { image.setTo(0); });
  Change(12, [](cv::Mat& image) { image = 0.5 * image + 20; });
  for (const char* side : {"left", "right"}) {
    std::filesystem::copy_file(Image(side, 15), Image(side, 16),
                               std::filesystem::copy_options::overwrite_existing);
  }
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Values depth = Depth(), scale = Found("inverse_scale"), disparity = Found("disparity");
  for (const int k : {5, 6, 7}) {
    EXPECT_FALSE(scale.contains(k) || disparity.contains(k)) << k;
  }
  for (int k = 8; k < 21; ++k) {
    ASSERT_TRUE(scale.contains(k) && disparity.contains(k)) << k;
    const double z = depth.at(k == 16 ? 15 : k);
    EXPECT_NEAR(scale.at(k), z / depth.at(0), 2.5e-3 * scale.at(k)) << k;
    EXPECT_NEAR(disparity.at(k), 120.0 * 0.065 / z, 0.05) << k;
  }
}

TEST_F(StereoTarget, WithoutTextureThereIsNoDisparity) {
  MakePair();
  cv::RNG random(7);
  for (int k = 0; k < 21; ++k) {
    Change(k, [&](cv::Mat& image) {
      cv::Mat noise(image.size(), CV_32F);
      random.fill(noise, cv::RNG::NORMAL, 100.0, 1.0);
      noise.convertTo(image, CV_8U);
    });
  }
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Found("disparity").empty());
}

TEST_F(StereoTarget, AMatchThatRepeatsIsNone) {
  MakePair();
  // Vertical stripes with a period of 12 px match at every multiple of 12 px of disparity. The rows
  // of the stripes differ.
  for (int k = 0; k < 21; ++k) {
    Change(k, [&](cv::Mat& image) {
      for (int y = 0; y < image.rows; ++y) {
        for (int x = 0; x < image.cols; ++x) {
          const double wave = std::sin(x * M_PI / 6) + std::sin(0.31 * y) + std::sin(0.173 * y);
          image.at<unsigned char>(y, x) = cv::saturate_cast<unsigned char>(128 + 40 * wave);
        }
      }
    });
  }
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Found("disparity").empty());
  EXPECT_EQ(Found("inverse_scale").size(), 21u);
  // The repeated match is the only reason why disparities are missing. Without the check,
  // disparities are found.
  ASSERT_EQ(Measure({"--set", "source.disparity.min_distinct=0"}).code, 0);
  EXPECT_FALSE(Found("disparity").empty());
}

TEST_F(StereoTarget, OneCameraMeasuresTheSizeAlone) {
  MakePair();
  Write("config.yaml", R"(alidade: 1
source: {type: stereo_target, left: 'pair/images/left/*.png', rate_hz: 20, boxes: boxes.csv}
)");
  Write("boxes.csv", "frame,x,y,width,height\n0,75,45,90,90\n");
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Found("disparity").empty());
  EXPECT_EQ(Found("inverse_scale").size(), 21u);
}

TEST_F(StereoTarget, APlaneThatTiltsKeepsItsDepth) {
  // Draws a textured plate 2 m ahead by means of a homography. The plate is tilted and moved back
  // step by step.
  const cv::Matx33d k(200, 0, 160, 0, 200, 120, 0, 0, 1);
  cv::Mat texture(240, 320, CV_8U);
  cv::RNG random(3);
  random.fill(texture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(texture, texture, {}, 2.5);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  std::filesystem::create_directories(folder_ / "plate");
  std::vector<double> ratios;
  for (int i = 0; i < 12; ++i) {
    const cv::Vec3d axis = 0.05 * i * cv::Vec3d(0.6, 0.8, 0.0);
    cv::Matx33d turn;
    cv::Rodrigues(axis, turn);
    const double z0 = 2.0, z = z0 * (1.0 + 0.02 * i);
    // A point X = (x, y, z0) of the plate moves to X' = R (X - c) + (0, 0, z). The middle of the
    // plate is c = (0, 0, z0).
    const cv::Vec3d t = cv::Vec3d(0, 0, z) - turn * cv::Vec3d(0, 0, z0);
    const cv::Matx33d h = k * (turn + cv::Matx31d(t) * cv::Matx13d(0, 0, 1.0 / z0)) * k.inv();
    cv::Mat image;
    cv::warpPerspective(texture, image, h, texture.size(), cv::INTER_CUBIC);
    char name[32];
    std::snprintf(name, sizeof name, "plate/%03d.png", i);
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), image));
    ratios.push_back(z / z0);
  }
  Write("config.yaml", R"(alidade: 1
camera: {model: pinhole, width: 320, height: 240, fx: 200, fy: 200, cx: 160, cy: 120}
source: {type: stereo_target, left: plate, rate_hz: 20, target: [110, 70, 101, 101],
         warp: homography}
)");
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Values scale = Found("inverse_scale");
  ASSERT_EQ(scale.size(), 12u);
  for (const auto& [frame, value] : scale) {
    EXPECT_NEAR(value, ratios[static_cast<std::size_t>(frame)], 3e-3) << frame;
  }
}

TEST_F(StereoTarget, WhatCoversTheTargetIsNotIt) {
  MakePair();
  // A plate slides over the target from the left and covers the target until image 12. Later images
  // are unchanged.
  cv::Mat plate(180, 240, CV_8U);
  cv::RNG random(5);
  random.fill(plate, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(plate, plate, {}, 2.0);
  for (int k = 4; k < 18; ++k) {
    const int edge = std::min(240, 60 * (k - 3));
    Change(k, [&](cv::Mat& image) {
      plate.colRange(240 - edge, 240).copyTo(image.colRange(0, edge));
    });
  }
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Values depth = Depth(), scale = Found("inverse_scale");
  for (int k = 8; k < 18; ++k) EXPECT_FALSE(scale.contains(k)) << k;
  for (int k = 18; k < 21; ++k) {
    ASSERT_TRUE(scale.contains(k)) << k;
    EXPECT_NEAR(scale.at(k), depth.at(k) / depth.at(0), 3e-3 * scale.at(k)) << k;
  }
}

/// Draws a textured square in front of a textured wall. The square grows. From image 1 on it also
/// moves up or down by 16 px between images. Each image is the mean over its exposure, which lasts
/// four fifths of the interval between images. Returns the size of the square relative to image 0.
std::vector<double> DrawSwing(const std::filesystem::path& folder, int count) {
  std::filesystem::create_directories(folder);
  cv::RNG random(11);
  cv::Mat texture(64, 64, CV_8U), wall(180, 240, CV_8U);
  for (cv::Mat* const one : {&texture, &wall}) {
    random.fill(*one, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(*one, *one, {}, 1.5);
    cv::normalize(*one, *one, 20, 235, cv::NORM_MINMAX);
    one->convertTo(*one, CV_32F);
  }
  std::vector<double> sizes;
  for (int i = 0; i < count; ++i) {
    constexpr int kParts = 24;
    constexpr double kReach = 32.0, kSpeed = 16.0;  // amplitude in px, and speed in px per image
    cv::Mat mean(wall.size(), CV_32F, cv::Scalar(0.0));
    for (int part = 0; part < kParts; ++part) {
      const double t = i + 0.8 * ((part + 0.5) / kParts - 0.5);
      const double scale = 0.6 * (1.0 + 0.01 * t), middle = 31.5 * scale;
      const double way = M_PI_2 * kSpeed / kReach * std::max(0.0, t - 1.0);
      const double y = 90.0 + kReach / M_PI_2 * std::asin(std::sin(way));
      const cv::Matx23d at(scale, 0, 120.0 - middle, 0, scale, y - middle);
      cv::Mat image = wall.clone();
      cv::warpAffine(texture, image, at, image.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
      mean += image / kParts;
    }
    cv::Mat noise(mean.size(), CV_32F), image;
    random.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
    cv::Mat(mean + noise).convertTo(image, CV_8U);
    EXPECT_TRUE(cv::imwrite((folder / cv::format("%03d.png", i)).string(), image));
    sizes.push_back(1.0 + 0.01 * i);
  }
  return sizes;
}

TEST_F(StereoTarget, ATargetIsMeasuredInImagesThatItsMotionBlurs) {
  const std::vector<double> sizes = DrawSwing(folder_ / "swing", 40);
  Write("config.yaml", R"(alidade: 1
source: {type: stereo_target, left: swing, rate_hz: 20, target: [101, 71, 38, 38]}
)");
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Values scale = Found("inverse_scale");
  EXPECT_GE(scale.size(), 38u);  // only 10 if the template were not blurred
  for (const auto& [frame, value] : scale) {
    EXPECT_NEAR(value * sizes[static_cast<std::size_t>(frame)], 1.0, 0.02) << frame;
  }
  // Measurements that have a large uncertainty because of blur can be omitted.
  ASSERT_EQ(Measure({"--set", "source.max_relative_sigma=0.01"}).code, 0);
  EXPECT_LT(Found("inverse_scale").size(), scale.size());
}

TEST_F(StereoTarget, ATargetThatIsGoneIsNotFoundElsewhere) {
  DrawSwing(folder_ / "swing", 2);
  // The next 54 images have other content. In each of these images, some place is the best match.
  cv::RNG random(2);
  for (int k = 2; k < 56; ++k) {
    cv::Mat image(180, 240, CV_8U);
    random.fill(image, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(image, image, {}, 3.0);
    cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
    ASSERT_TRUE(cv::imwrite((folder_ / "swing" / cv::format("%03d.png", k)).string(), image));
  }
  Write("config.yaml", R"(alidade: 1
source: {type: stereo_target, left: swing, rate_hz: 20, target: [114, 84, 12, 12]}
)");
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Values scale = Found("inverse_scale");
  EXPECT_GE(scale.size(), 1u);
  for (const auto& [frame, value] : scale) EXPECT_LT(frame, 2) << value;
}

TEST_F(StereoTarget, ImagesBeforeTheStartAreLeftOut) {
  MakePair();
  ASSERT_EQ(Measure({"--set", "source.start_frame=3", "--set", "source.max_frames=10", "--set",
                     "source.target=[85, 55, 70, 70]"})
                .code,
            0);
  const Values depth = Depth(), scale = Found("inverse_scale"), disparity = Found("disparity");
  ASSERT_EQ(scale.size(), 10u);
  EXPECT_EQ(disparity.size(), 10u);
  for (const auto& [frame, value] : scale) {
    EXPECT_NEAR(value, depth.at(frame + 3) / depth.at(3), 2.5e-3 * value) << frame;
    EXPECT_NEAR(disparity.at(frame), 120.0 * 0.065 / depth.at(frame + 3), 0.05) << frame;
  }
}

TEST_F(StereoTarget, ABoxSaysWhereItIsAndThatItIsNot) {
  MakePair();
  Write("config.yaml", R"(alidade: 1
source: {type: stereo_target, left: pair/images/left, rate_hz: 20, boxes: boxes.csv}
)");
  // Rows may give four corners, here with errors of a pixel. A row of nan marks an image without
  // the target.
  Write("boxes.csv", "0,75,45,165,44,164,135,74,134\n5,nan,nan,nan,nan\n");
  ASSERT_EQ(Measure().code, 0);
  const Values depth = Depth(), scale = Found("inverse_scale");
  EXPECT_EQ(scale.size(), 20u);
  EXPECT_FALSE(scale.contains(5));
  for (const auto& [frame, value] : scale) {
    EXPECT_NEAR(value, depth.at(frame) / depth.at(0), 5e-3 * value) << frame;
  }
  // The first image with a box is black, so the next box is used.
  Change(0, [](cv::Mat& image) { image.setTo(0); });
  Write("boxes.csv", "0,75,45,90,90\n1,75,45,90,90\n");
  ASSERT_EQ(Measure().code, 0);
  EXPECT_EQ(Found("inverse_scale").size(), 20u);
}

TEST_F(StereoTarget, BadInputIsNamed) {
  MakePair();
  const auto expect = [&](const testing::Arguments& more, int code, const std::string& text) {
    const Outcome outcome = Measure(more);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_TRUE(Contains(outcome.err, text)) << outcome.err;
  };
  expect({"--set", "source.left=nowhere"}, 66, "no such file or folder");
  expect({"--set", "source.target=[75, 45, 4, 90]"}, 78, "less than 8 px");
  expect({"--set", "source.target=[0, 0, 0, 0]"}, 78, "less than 8 px");
  expect({"--set", "source.target=[200, 45, 90, 90]"}, 65, "the target is not inside this image");
  expect({"--set", "source.stereo=pair.yaml"}, 65, "cannot read this calibration");
  expect({"--set", "source.warp=homography"}, 78, "camera.fx");
  expect({"--set", "source.start_frame=21"}, 78,
         "source.start_frame: image 21 does not exist; the source has 21 images");
  expect({"--set", "camera={width: 320, height: 180}"}, 65,
         "000000.png: the image is 240x180 px, but the camera of --set");
  Write("times.csv", "0,0\n1,1\n2,2\n4,4\n");
  expect({"--set", "source.timestamps=times.csv"}, 65, "times.csv:4: there is no time for image 3");
  Write("boxes.csv", "frame,x,y,width,height\n0,75,45,2,90\n");
  expect({"--set", "source.boxes=boxes.csv"}, 65, "boxes.csv:2:");
  Write("boxes.csv", "0,165,45,75,45,75,134,165,134\n");
  expect({"--set", "source.boxes=boxes.csv"}, 65, "not in order");
  Write("boxes.csv", "frame,x,y,width,height\n");
  expect({"--set", "source.boxes=boxes.csv"}, 65, "contains no rows");
  const auto calibration = [](const std::string& r) {
    const std::string m = "!!opencv-matrix\n  rows: 3\n  cols: 3\n  dt: d\n  data: ";
    const std::string k = m + "[120, 0, 120, 0, 120, 90, 0, 0, 1]\n";
    const std::string d = "!!opencv-matrix\n  rows: 1\n  cols: 4\n  dt: d\n  data: [0, 0, 0, 0]\n";
    return "%YAML:1.0\n---\nM1: " + k + "D1: " + d + "M2: " + k + "D2: " + d + "R: " + m + r +
           "\nT: !!opencv-matrix\n  rows: 3\n  cols: 1\n  dt: d\n  data: [-0.065, 0, 0]\n";
  };
  Write("stereo.yml", calibration("[0, 0, 0, 0, 0, 0, 0, 0, 0]"));
  expect({"--set", "source.stereo=stereo.yml"}, 65, "'R' is not a rotation");
  Write("stereo.yml", calibration("[1, 0, 0, 0, 1, 0, 0, 0, 1]"));
  expect({"--set", "source.stereo=stereo.yml"}, 0, "");
  Write("truth.csv", "depth\n1\n");
  expect({"--set", "source.truth=truth.csv"}, 65, "t_s,NAME");
  std::filesystem::remove(Image("right", 20));
  expect({}, 78, "'right' has 20 images, but 'left' has 21");
  std::filesystem::remove(Image("left", 20));
  cv::Mat small(90, 120, CV_8U, cv::Scalar(9));
  ASSERT_TRUE(cv::imwrite(Image("right", 10), small));
  expect({"--set", "source.rate_hz=20"}, 65, "000010.png: the image is 120x90 px");
}

TEST_F(StereoTarget, Example28IsBetterThanItsSimulatedNoise) {
  const std::string example = std::string(ALIDADE_SOURCE_DIR) + "/examples/28_depth_images/";
  for (const char* name : {"scene.yaml", "config.yaml"}) {
    std::filesystem::copy_file(example + name, folder_ / name,
                               std::filesystem::copy_options::overwrite_existing);
  }
  // The sequence is 1.8 s long. Stereo is blind from 1.25 s on because the target is too near.
  const Outcome made = Call({"simulate", "scene.yaml", "-o", "pair", "--images", "images", "--set",
                             "source.duration_s=1.8"});
  ASSERT_EQ(made.code, 0) << made.err;
  const auto run = [&](testing::Arguments arguments) {
    arguments.insert(arguments.begin(), {"run"});
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  };
  const auto rmse = [&](const std::string& folder, const std::string& key) {
    const std::string table = Read(folder + "/comparison.csv");
    const std::size_t at = table.find(key + ',');
    EXPECT_NE(at, table.npos) << table;
    return std::stod(table.substr(at + key.size() + 1));
  };
  const std::filesystem::path five =
      std::filesystem::path(ALIDADE_SOURCE_DIR) / "examples/05_depth_principled/config.yaml";
  Write("ideal.yaml", testing::ReadText(five));
  run({"config.yaml", "-o", "images_run"});
  run({"ideal.yaml", "-o", "ideal_run", "--set", "source.duration_s=1.8"});
  for (const char* key : {"rmse:target.depth", "rmse:target.depth@blind"}) {
    EXPECT_LT(rmse("images_run", key), 0.2 * rmse("ideal_run", key)) << key;
  }
}

/// Data of 13 real stereo pairs of a chessboard, whose corners determine the true depth.
TEST_F(StereoTarget, ABoardOfAChessIsAsFarAsItsCornersSay) {
  const char* const data = std::getenv("ALIDADE_DATA");
  const std::filesystem::path boards =
      std::filesystem::path(data == nullptr ? "" : data) / "stereo-chessboard";
  if (data == nullptr || !std::filesystem::exists(boards / "left01.jpg")) {
    GTEST_SKIP() << "ALIDADE_DATA does not contain stereo-chessboard";
  }
  const cv::Size pattern(9, 6);
  constexpr float kSquare = 0.025F;
  std::vector<cv::Point3f> board;
  for (int i = 0; i < 54; ++i) {
    board.emplace_back(kSquare * static_cast<float>(i % 9), kSquare * static_cast<float>(i / 9),
                       0.0F);
  }
  std::vector<std::vector<cv::Point3f>> boards3;
  std::vector<std::vector<cv::Point2f>> corners[2];
  cv::Size size;
  for (int k = 1; k <= 14; ++k) {
    if (k == 10) continue;
    for (const int side : {0, 1}) {
      const std::string name = cv::format("%s%02d.jpg", side == 0 ? "left" : "right", k);
      const cv::Mat image = cv::imread((boards / name).string(), cv::IMREAD_GRAYSCALE);
      size = image.size();
      std::vector<cv::Point2f> found;
      ASSERT_TRUE(cv::findChessboardCorners(image, pattern, found)) << name;
      cv::cornerSubPix(image, found, {5, 5}, {-1, -1},
                       {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3});
      if (found.front().y > found.back().y) std::ranges::reverse(found);
      corners[side].push_back(found);
    }
    boards3.push_back(board);
  }
  cv::FileStorage intrinsics((boards / "intrinsics.yml").string(), cv::FileStorage::READ);
  cv::Mat m1, d1, m2, d2, r, t, e, f;
  intrinsics["M1"] >> m1;
  intrinsics["D1"] >> d1;
  intrinsics["M2"] >> m2;
  intrinsics["D2"] >> d2;
  cv::stereoCalibrate(boards3, corners[0], corners[1], m1, d1, m2, d2, size, r, t, e, f,
                      cv::CALIB_USE_INTRINSIC_GUESS);
  {
    cv::FileStorage stereo((folder_ / "stereo.yml").string(), cv::FileStorage::WRITE);
    stereo << "M1" << m1 << "D1" << d1 << "M2" << m2 << "D2" << d2 << "R" << r << "T" << t;
  }
  // The source measures in the rectified left camera. The centre of the board in this camera is
  // computed from the corners of the board.
  cv::Mat r1, r2, p1, p2, q;
  cv::stereoRectify(m1, d1, m2, d2, size, r, t, r1, r2, p1, p2, q, cv::CALIB_ZERO_DISPARITY, 0.0);
  std::vector<double> depth_m;
  std::ostringstream boxes;
  for (std::size_t i = 0; i < corners[0].size(); ++i) {
    cv::Mat turn, shift, matrix;
    ASSERT_TRUE(cv::solvePnP(board, corners[0][i], m1, d1, turn, shift));
    cv::Rodrigues(turn, matrix);
    const cv::Mat middle = (cv::Mat_<double>(3, 1) << 4 * kSquare, 2.5 * kSquare, 0.0);
    const cv::Mat at = r1 * (matrix * middle + shift);
    depth_m.push_back(at.at<double>(2));
    boxes << i;
    for (const std::size_t corner : {0, 8, 53, 45}) {
      boxes << ',' << corners[0][i][corner].x << ',' << corners[0][i][corner].y;
    }
    boxes << '\n';
  }
  Write("boxes.csv", boxes.str());
  Write("config.yaml", "alidade: 1\nsource: {type: stereo_target, left: '" +
                           (boards / "left??.jpg").string() + "', right: '" +
                           (boards / "right??.jpg").string() +
                           "', stereo: stereo.yml, boxes: boxes.csv, rate_hz: 1, warp: homography, "
                           "refresh_similarity: 0}\n");
  const Outcome outcome = Measure();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const double focal_px = p1.at<double>(0, 0), bf = -p2.at<double>(0, 3);
  std::vector<double> by_disparity, by_scale;
  for (const auto& [frame, value] : Found("disparity")) {
    by_disparity.push_back(std::abs(bf / value / depth_m[static_cast<std::size_t>(frame)] - 1.0));
  }
  for (const auto& [frame, value] : Found("inverse_scale")) {
    if (frame == 0) continue;
    by_scale.push_back(
        std::abs(value * depth_m[0] / depth_m[static_cast<std::size_t>(frame)] - 1.0));
  }
  const auto median = [](std::vector<double> values) {
    std::ranges::sort(values);
    return values.empty() ? 1.0 : values[values.size() / 2];
  };
  EXPECT_GT(focal_px, 300.0);
  EXPECT_GE(by_disparity.size(), 10u);
  EXPECT_GE(by_scale.size(), 10u);
  EXPECT_LT(median(by_disparity), 0.01);
  EXPECT_LT(median(by_scale), 0.02);
  RecordProperty("median_by_disparity", std::to_string(median(by_disparity)));
  RecordProperty("median_by_scale", std::to_string(median(by_scale)));
}

/// Videos of faces with labelled boxes [Kalal2010]. All videos use the same config, which contains
/// only the first box.
class StereoTargetOfFaces : public StereoTarget {
 protected:
  /// Checks the median relative error of the target's size. At least `fewest` images must have a
  /// measurement.
  void ExpectSizes(const std::string& name, std::size_t fewest) {
    const char* const data = std::getenv("ALIDADE_DATA");
    const auto video = std::filesystem::path(data == nullptr ? "" : data) / "tld-boxes" / name;
    if (data == nullptr || !std::filesystem::exists(video)) {
      GTEST_SKIP() << "ALIDADE_DATA does not contain tld-boxes";
    }
    std::vector<cv::Rect2d> boxes;
    std::istringstream rows(testing::ReadText(video.parent_path() / "gt.txt"));
    for (std::string row; std::getline(rows, row);) {
      double x0, y0, x1, y1;
      const int read = std::sscanf(row.c_str(), "%lf,%lf,%lf,%lf", &x0, &y0, &x1, &y1);
      boxes.push_back(read == 4 ? cv::Rect2d(x0, y0, x1 - x0, y1 - y0) : cv::Rect2d());
    }
    const cv::Rect2d& first = boxes.at(0);
    Write("config.yaml", cv::format("alidade: 1\nsource: {type: stereo_target, left: '%s', target: "
                                    "[%g, %g, %g, %g], max_relative_sigma: 0.1, max_frames: 400}\n",
                                    video.c_str(), first.x, first.y, first.width, first.height));
    const Outcome outcome = Measure();
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::vector<double> errors;
    for (const auto& [frame, inverse_scale] : Found("inverse_scale")) {
      const cv::Rect2d& box = boxes.at(static_cast<std::size_t>(frame));
      if (frame == 0 || !(box.area() > 0.0)) continue;
      errors.push_back(std::abs(std::sqrt(first.area() / box.area()) / inverse_scale - 1.0));
    }
    ASSERT_GT(errors.size(), fewest);
    const auto middle = errors.begin() + std::ssize(errors) / 2;
    std::ranges::nth_element(errors, middle);
    RecordProperty("median", std::to_string(*middle) + " of " + std::to_string(errors.size()));
    EXPECT_LT(*middle, 0.1);
  }
};

TEST_F(StereoTargetOfFaces, AreAsLargeAsTheirBoxes) { ExpectSizes("01_david/david.mpg", 300); }
TEST_F(StereoTargetOfFaces, AreAsLargeAsTheirBoxesWhereMotionBlursThem) {
  ExpectSizes("02_jumping/jumping.mpg", 100);
}

}  // namespace
}  // namespace alidade
