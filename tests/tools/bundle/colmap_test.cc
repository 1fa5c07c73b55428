// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "alidade/bundle/bundle_file.h"
#include "alidade/estimation/direct_models.h"
#include "support/colmap_formula.h"
#include "support/temporary_folder.h"

namespace alidade {
namespace {

/// The camera is rotated by 90 degrees about its z axis, (x, y) -> (-y, x), and translated. In its
/// frame, the point (0.2, 0.1, 3) is at (-0.1, 0.2, 4): x = -0.025, y = 0.05, q = 0.003125. With
/// f = 400 px and k = 2, f s = 402.5 px: the pixel is (320 - 10.0625, 240 + 20.125).
const std::string kCameras = "# Camera list\n3 SIMPLE_RADIAL 640 480 400 320 240 2\n";
const std::string kImages =
    "# Image list\n12 0.7071067811865476 0 0 0.7071067811865476 0 0 1 3 a b.jpg\n"
    "1 2 -1 309.9375 260.125 50\n13 1 0 0 0 0 0 0 3 c.jpg\n\n";
const std::string kPoints = "50 0.2 0.1 3 9 8 7 0.5 12 1\n60 1 2 3 0 0 0 -1\n";

class Colmap : public ::testing::Test {
 protected:
  void Write(const std::string& cameras, const std::string& images,
             const std::string& points) const {
    std::filesystem::create_directories(folder());
    std::ofstream(folder() / "cameras.txt") << cameras;
    std::ofstream(folder() / "images.txt") << images;
    std::ofstream(folder() / "points3D.txt") << points;
  }
  std::filesystem::path folder() const { return folder_ / "sparse"; }
  /// Expects that reading the folder fails with a message that contains the place and `words`.
  void ExpectBad(const std::string& place, const std::string& words) const {
    try {
      ReadBundle(folder());
      ADD_FAILURE() << "no error; expected: " << words;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      const std::string what = e.what();
      EXPECT_EQ(what.find((folder() / place).string()), 0u) << what;
      EXPECT_NE(what.find(words), what.npos) << what;
    }
  }
  static std::string Changed(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Colmap, ReadsAFolder) {
  Write(kCameras, kImages, kPoints);
  const BundleFile file = ReadBundle(folder());
  EXPECT_EQ(file.format, BundleFormat::kColmap);
  EXPECT_EQ(file.camera_ids, (std::vector<std::int64_t>{12, 13}));
  EXPECT_EQ(file.point_ids, (std::vector<std::int64_t>{50, 60}));
  EXPECT_EQ(file.problem.intrinsics,
            (std::vector<std::vector<double>>{{400, 320, 240, 2, 0, 0, 0, 0}}));
  ASSERT_EQ(file.problem.observations.size(), 1u);
  // world_from_cam: the origin of the camera is -R't = (0, 0, -1).
  EXPECT_NEAR(file.problem.cameras[0].position[2], -1.0, 1e-15);
  EXPECT_NEAR(file.problem.cameras[0].orientation[3], -std::sqrt(0.5), 1e-15);
  EXPECT_LT(BundleRms(*MakeSensor(SelfCalibratingFeature<RadtanLens>(1.0)), file.problem), 1e-12);
}

TEST_F(Colmap, ReadsAFileOfTheFolderAsTheFolder) {
  Write(kCameras, kImages, kPoints);
  EXPECT_EQ(ReadBundle(folder() / "images.txt").camera_ids, (std::vector<std::int64_t>{12, 13}));
}

/// The files are those of the input, apart from the comments and the errors of the points.
TEST_F(Colmap, IsReadAndWrittenWithoutALoss) {
  Write(kCameras, kImages, kPoints);
  const auto texts = BundleTexts(ReadBundle(folder()));
  ASSERT_EQ(texts.size(), 3u);
  const auto content = [](const std::string& text) {
    std::string rows, line;
    for (std::istringstream lines(text); std::getline(lines, line);)
      if (!line.starts_with('#')) rows += line + '\n';
    return rows;
  };
  EXPECT_EQ(texts[0].first, "problem/cameras.txt");
  EXPECT_EQ(content(texts[0].second), content(kCameras));
  EXPECT_EQ(texts[1].first, "problem/images.txt");
  EXPECT_EQ(content(texts[1].second), content(kImages));
  EXPECT_EQ(texts[2].first, "problem/points3D.txt");
  EXPECT_EQ(content(texts[2].second), Changed(kPoints, "7 0.5 12", "7 -1 12"));
}

/// The model of each camera is the formula of COLMAP. The parameters that the model does not have,
/// and the principal point, are constant.
TEST_F(Colmap, HasTheCameraModelsOfColmap) {
  using Sensors = std::pair<const char*, SharedSensor>;
  const Sensors radtan{"lens: radtan", MakeSensor(SelfCalibratingFeature<RadtanLens>(1.0))};
  const Sensors opencv{"lens: opencv", MakeSensor(SelfCalibratingFeature<OpenCvLens>(1.0))};
  for (const auto& [model, parameters, sensor, fixed] :
       std::vector<std::tuple<std::string, std::vector<double>, Sensors, std::size_t>>{
           {"SIMPLE_PINHOLE", {700, 500, 400}, radtan, 7},
           {"PINHOLE", {700, 710, 500, 400}, opencv, 6},
           {"SIMPLE_RADIAL", {700, 500, 400, -0.1}, radtan, 6},
           {"RADIAL", {700, 500, 400, -0.1, 0.02}, radtan, 5},
           {"OPENCV", {700, 710, 500, 400, -0.1, 0.02, 0.001, -0.002}, opencv, 2}}) {
    testing::WriteColmap(folder(), model, parameters, 0.0);
    const BundleFile file = ReadBundle(folder());
    EXPECT_NE(file.problem.sensor.find(sensor.first), std::string::npos) << model;
    EXPECT_EQ(file.problem.observations.size(), 180u);
    EXPECT_LT(BundleRms(*sensor.second, file.problem), 1e-10) << model;
    const std::vector<bool> constant = FixedElements(*sensor.second, file.problem.fixed);
    EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(constant, true)), fixed) << model;
  }
}

TEST_F(Colmap, RefusesWhatItDoesNotRead) {
  Write(Changed(kCameras, "SIMPLE_RADIAL", "OPENCV_FISHEYE"), kImages, kPoints);
  ExpectBad("cameras.txt:2:3",
            "the camera model OPENCV_FISHEYE is not supported; expected SIMPLE_PINHOLE, PINHOLE, "
            "SIMPLE_RADIAL, RADIAL, OPENCV");
  Write(kCameras + "4 PINHOLE 640 480 400 400 320 240\n", kImages, kPoints);
  ExpectBad("cameras.txt:3:3", "SIMPLE_RADIAL and PINHOLE are mixed; expected one model");
  Write(kCameras + "3 SIMPLE_RADIAL 640 480 400 320 240 2\n", kImages, kPoints);
  ExpectBad("cameras.txt:3:1", "occurs a second time");
  Write(Changed(kCameras, "240 2", "240 2 3"), kImages, kPoints);
  ExpectBad("cameras.txt:2:39", "additional numbers; expected 4 parameters of SIMPLE_RADIAL");
  Write(Changed(kCameras, "480 400", "480 0"), kImages, kPoints);
  ExpectBad("cameras.txt:2:25", "the focal length is not positive");
  Write(kCameras, Changed(kImages, "125 50", "125 51"), kPoints);
  ExpectBad("images.txt:3:25", "does not exist; expected the id of a point in points3D.txt, or -1");
  Write(kCameras, Changed(kImages, "1 3 a", "1 4 a"), kPoints);
  ExpectBad("images.txt:2:", "does not exist; expected the id of a camera in cameras.txt");
  Write(kCameras, Changed(kImages, " 260.125 50", ""), kPoints);
  ExpectBad("images.txt:3:16", "the line ends here; expected a feature");
  Write(Changed(kCameras, "320 240 2", "320"), kImages, kPoints);
  ExpectBad("cameras.txt:2:", "the line ends here; expected a parameter of a camera");
  Write("# nothing\n", kImages, kPoints);
  ExpectBad("cameras.txt:2:1", "the file contains no camera");
  std::filesystem::rename(folder() / "cameras.txt", folder() / "cameras.bin");
  ExpectBad("cameras.bin", "binary files of COLMAP are not supported; expected text files");
}

TEST_F(Colmap, AFolderWithoutItsFilesIsMissingInput) {
  try {
    ReadBundle(folder_.path());
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kInputMissing);
    EXPECT_NE(std::string(e.what()).find("expected a COLMAP folder: cameras.txt"),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace alidade
