// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/calibration_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "support/temporary_folder.h"

namespace alidade {
namespace {

class CalibrationFileForms : public ::testing::Test {
 protected:
  Config ReadText(const std::string& text, const CalibrationOptions& options = {}) const {
    std::ofstream(folder_ / "calibration.yaml") << text;
    return ReadCalibrationFile(folder_ / "calibration.yaml", options);
  }
  /// Returns the value of a key of the camera, "none", or the error.
  std::string Get(const std::string& text, const std::string& key,
                  const CalibrationOptions& options = {}) const {
    try {
      const Config config = ReadText(text, options);
      const auto node = config.root().At("calibration").At("camera").Find(key);
      return node ? node->Text() : "none";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadData);
      return error.what();
    }
  }
  double Number(const std::string& text, const std::string& key,
                const CalibrationOptions& options = {}) const {
    return std::stod(Get(text, key, options));
  }
  /// Expects these keys and values of the camera.
  void ExpectCamera(const std::string& text, const std::string& model,
                    const std::vector<std::pair<std::string, double>>& values) const {
    EXPECT_EQ(Get(text, "model"), model);
    for (const auto& [key, value] : values) EXPECT_DOUBLE_EQ(Number(text, key), value) << key;
  }
  /// Expects that reading fails with a message that contains the place and `words`.
  void ExpectError(const std::string& text, const std::string& place, const std::string& words,
                   const CalibrationOptions& options = {}) const {
    const std::string error = Get(text, "fx", options);
    EXPECT_NE(error.find("calibration.yaml:" + place), error.npos) << error;
    EXPECT_NE(error.find(words), error.npos) << error;
  }

  testing::TemporaryFolder folder_;
};

std::string Changed(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

constexpr const char* kOpenCv = R"(%YAML:1.0
---
calibration_time: "Wed Nov 25 2026"
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 535.4, 0., 320.1, 0.,
       539.2, 247.6, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0.26, -0.95, 0.005, 0.003, 1.16 ]
avg_reprojection_error: 0.2
)";

constexpr const char* kRos = R"(image_width: 640
image_height: 480
camera_name: narrow
camera_matrix: {rows: 3, cols: 3, data: [400, 0, 320, 0, 401, 240, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
)";

constexpr const char* kKalibr = R"(cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.0034, 0.0007, -0.0021, 0.0002]
  distortion_model: equidistant
  intrinsics: [190.98, 190.97, 254.93, 256.90]
  resolution: [512, 512]
  rostopic: /cam0/image_raw
)";

constexpr const char* kEuroc = R"(sensor_type: camera
comment: VI-Sensor cam0
T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375]
distortion_model: radial-tangential
distortion_coefficients: [-0.283, 0.074, 0.0002, 1.8e-05]
)";

TEST_F(CalibrationFileForms, OpenCv) {
  EXPECT_EQ(Get(kOpenCv, "model"), "radtan");
  EXPECT_EQ(Get(kOpenCv, "width"), "640");
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "fx"), 535.4);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "fy"), 539.2);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "cx"), 320.1);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "cy"), 247.6);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "k2"), -0.95);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "p1"), 0.005);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "p2"), 0.003);
  EXPECT_DOUBLE_EQ(Number(kOpenCv, "k3"), 1.16);
}

TEST_F(CalibrationFileForms, RosWithoutDistortionIsAPinhole) {
  EXPECT_EQ(Get(kRos, "model"), "pinhole");
  EXPECT_DOUBLE_EQ(Number(kRos, "fy"), 401.0);
  EXPECT_EQ(Get(kRos, "k1"), "none");
}

TEST_F(CalibrationFileForms, Kalibr) {
  EXPECT_EQ(Get(kKalibr, "model"), "equidistant");
  EXPECT_EQ(Get(kKalibr, "height"), "512");
  EXPECT_DOUBLE_EQ(Number(kKalibr, "cy"), 256.90);
  EXPECT_DOUBLE_EQ(Number(kKalibr, "k4"), 0.0002);
}

TEST_F(CalibrationFileForms, ADirectiveIsNotContent) {
  EXPECT_DOUBLE_EQ(Number(std::string("%YAML 1.2\n---\n") + kKalibr, "cy"), 256.90);
}

TEST_F(CalibrationFileForms, Euroc) {
  EXPECT_EQ(Get(kEuroc, "model"), "radtan");
  EXPECT_EQ(Get(kEuroc, "width"), "752");
  EXPECT_DOUBLE_EQ(Number(kEuroc, "p2"), 1.8e-05);
  EXPECT_DOUBLE_EQ(Number(kEuroc, "k3"), 0.0);
}

TEST_F(CalibrationFileForms, RosPlumbBobMayHaveMoreThanFiveCoefficientsIfTheyAreZero) {
  const std::string eight =
      Changed(kRos, "[0, 0, 0, 0, 0]", "[-0.2, 0.05, 0.001, -0.002, 0.006, 0, 0, 0]");
  ExpectCamera(eight, "radtan",
               {{"k1", -0.2}, {"k2", 0.05}, {"p1", 0.001}, {"p2", -0.002}, {"k3", 0.006}});
  EXPECT_EQ(Get(eight, "k4"), "none");
  ExpectError(Changed(eight, "0, 0, 0]", "0.1, 0, 0]"), "6:", "after the first 5 is not 0");
}

TEST_F(CalibrationFileForms, RosRationalPolynomial) {
  const std::string rational =
      Changed(Changed(kRos, "plumb_bob", "rational_polynomial"), "[0, 0, 0, 0, 0]",
              "[-0.2, 0.05, 0.001, -0.002, 0.006, 0.3, -0.04, 0.007]");
  ExpectCamera(rational, "rational_polynomial",
               {{"k1", -0.2},
                {"k2", 0.05},
                {"p1", 0.001},
                {"p2", -0.002},
                {"k3", 0.006},
                {"k4", 0.3},
                {"k5", -0.04},
                {"k6", 0.007}});
  EXPECT_EQ(Get(Changed(rational, "0.3, -0.04, 0.007", "0, 0, 0, 0, 0, 0"), "model"), "radtan");
  ExpectError(Changed(rational, "0.007]", "0.007, 0.01]"), "6:",
              "a coefficient after the first 8 is not 0; expected only k1, k2, p1, p2, k3, k4");
}

TEST_F(CalibrationFileForms, RosWithoutCoefficientsIsAPinhole) {
  EXPECT_EQ(Get(Changed(kRos, "[0, 0, 0, 0, 0]", "[]"), "model"), "pinhole");
  const std::string fisheye = Changed(kRos, "plumb_bob", "equidistant");
  EXPECT_EQ(Get(fisheye, "model"), "equidistant");
  ExpectError(Changed(fisheye, "[0, 0, 0, 0, 0]", "[]"), "6:", "the list is empty");
}

constexpr const char* kRosMessage = R"(header:
  stamp:
    sec: 12
    nanosec: 500
  frame_id: front
height: 480
width: 640
distortion_model: equidistant
d:
- -0.03
- 0.02
- -0.004
- 0.0005
k:
- 401.5
- 0.0
- 322.25
- 0.0
- 402.5
- 238.75
- 0.0
- 0.0
- 1.0
r: [1, 0, 0, 0, 1, 0, 0, 0, 1]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}
---
)";

TEST_F(CalibrationFileForms, RosMessagesAsEchoPrintsThem) {
  const std::vector<std::pair<std::string, double>> values = {
      {"width", 640}, {"height", 480}, {"fx", 401.5}, {"fy", 402.5},
      {"cx", 322.25}, {"cy", 238.75},  {"k1", -0.03}, {"k4", 0.0005}};
  ExpectCamera(kRosMessage, "equidistant", values);
  ExpectCamera(std::string("# one topic\n---\n") + kRosMessage + kRosMessage, "equidistant",
               values);
  ExpectCamera(
      "height: 48\nwidth: 64\ndistortion_model: \"plumb_bob\"\nD: [0.1, 0, 0, 0, 0]\n"
      "K: [50.0, 0.0, 32.0, 0.0, 51.0, 24.0, 0.0, 0.0, 1.0]\n---\n",
      "radtan", {{"fy", 51}, {"k1", 0.1}, {"width", 64}});
  ExpectError(Changed(kRosMessage, "binning_x: 0", "binning_x: 2"), "25:12", "binning");
}

TEST_F(CalibrationFileForms, KalibrWithoutDistortionIsAPinhole) {
  const std::string none =
      Changed(Changed(kKalibr, "equidistant", "none"), "[-0.0034, 0.0007, -0.0021, 0.0002]", "[]");
  ExpectCamera(none, "pinhole", {{"fx", 190.98}, {"width", 512}});
  EXPECT_EQ(Get(none, "k1"), "none");
}

TEST_F(CalibrationFileForms, AnEntrySelectsTheCamera) {
  const std::string pair =
      std::string(kKalibr) +
      "cam1:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0, 0, 0]\n"
      "  distortion_model: radtan\n  intrinsics: [70, 71, 72, 73]\n  resolution: [100, 90]\n";
  EXPECT_DOUBLE_EQ(Number(pair, "fx"), 190.98);
  EXPECT_DOUBLE_EQ(Number(pair, "fx", {.entry = "cam1"}), 70);
  ExpectError(pair, "1:1", "the file contains no camera 'cam2'", {.entry = "cam2"});
}

constexpr const char* kCamodocal = R"(%YAML:1.0
---
model_type: PINHOLE
camera_name: front
image_width: 640
image_height: 480
distortion_parameters:
   k1: -0.25
   k2: 0.06
   p1: 0.0004
   p2: -0.0006
projection_parameters:
   fx: 451.5
   fy: 452.5
   cx: 330.25
   cy: 241.75
)";

TEST_F(CalibrationFileForms, Camodocal) {
  ExpectCamera(kCamodocal, "radtan",
               {{"width", 640},
                {"height", 480},
                {"fx", 451.5},
                {"fy", 452.5},
                {"cx", 330.25},
                {"cy", 241.75},
                {"k1", -0.25},
                {"k2", 0.06},
                {"p1", 0.0004},
                {"p2", -0.0006},
                {"k3", 0}});
  ExpectCamera(
      "%YAML:1.0\nmodel_type: KANNALA_BRANDT\nimage_width: 64\nimage_height: 48\n"
      "projection_parameters: {k2: 0.01, k3: 0.02, k4: 0.03, k5: 0.04, mu: 50, mv: 51, "
      "u0: 32, v0: 24}\n",
      "equidistant",
      {{"k1", 0.01}, {"k2", 0.02}, {"k3", 0.03}, {"k4", 0.04}, {"fy", 51}, {"cy", 24}});
  ExpectCamera(Changed(Changed(kCamodocal, "PINHOLE", "PINHOLE_FULL"),
                       "   p1:", "   k3: 0.01\n   k4: 0.2\n   k5: 0.03\n   k6: 0.004\n   p1:"),
               "rational_polynomial", {{"k3", 0.01}, {"k6", 0.004}, {"p1", 0.0004}});
  ExpectError(Changed(kCamodocal, "PINHOLE", "MEI"), "3:13",
              "camera model 'MEI' is not supported; expected PINHOLE, PINHOLE_FULL or "
              "KANNALA_BRANDT");
}

constexpr const char* kOrbSlam = R"(%YAML:1.0
#----------------
File.version: "1.0"
Camera.type: "PinHole"
Camera1.fx: 451.5
Camera1.fy: 452.5
Camera1.cx: 330.25
Camera1.cy: 241.75
Camera1.k1: -0.25
Camera1.k2: 0.06
Camera1.p1: 0.0004
Camera1.p2: -0.0006
Camera2.fx: 461.5
Camera2.fy: 462.5
Camera2.cx: 340.25
Camera2.cy: 251.75
Camera.width: 640
Camera.height: 480
Stereo.T_c1_c2: !!opencv-matrix
  rows: 1
  cols: 1
  dt: f
  data: [1.0]
)";

TEST_F(CalibrationFileForms, OrbSlam) {
  ExpectCamera(kOrbSlam, "radtan",
               {{"width", 640},
                {"height", 480},
                {"fx", 451.5},
                {"fy", 452.5},
                {"cx", 330.25},
                {"cy", 241.75},
                {"k1", -0.25},
                {"k2", 0.06},
                {"p1", 0.0004},
                {"p2", -0.0006},
                {"k3", 0}});
  EXPECT_EQ(Get(kOrbSlam, "model", {.entry = "Camera2"}), "pinhole");
  EXPECT_DOUBLE_EQ(Number(kOrbSlam, "cy", {.entry = "Camera2"}), 251.75);
  const std::string second =
      "%YAML:1.0\nCamera.fx: 50\nCamera.fy: 51\nCamera.cx: 32\n"
      "Camera.cy: 24\nCamera.k1: 0.1\nCamera.k3: 0.3\nCamera.fps: 30\n";
  ExpectCamera(second, "radtan", {{"fx", 50}, {"k1", 0.1}, {"k3", 0.3}, {"p1", 0}});
  EXPECT_EQ(Get(second, "width"), "none");
  ExpectCamera(second + "Camera.k2: 0.2\nCamera.k4: 0.4\nCamera.type: KannalaBrandt8\n",
               "equidistant", {{"k1", 0.1}, {"k2", 0.2}, {"k3", 0.3}, {"k4", 0.4}});
  EXPECT_EQ(Get(second + "Camera.type: Rectified\n", "model"), "pinhole");
  ExpectError(Changed(kOrbSlam, "\"PinHole\"", "Mei"), "4:14", "camera model 'Mei'");
}

TEST_F(CalibrationFileForms, OpenCvFisheye) {
  EXPECT_EQ(Get(std::string(kOpenCv) + "fisheye_model: 0\n", "model"), "radtan");
  const std::string fisheye =
      Changed(kOpenCv, "[ 0.26, -0.95, 0.005, 0.003, 1.16 ]", "[ 0.1, 0.2, 0.3, 0.4 ]");
  ExpectCamera(fisheye + "fisheye_model: 1\n", "equidistant", {{"k3", 0.3}});
}

TEST_F(CalibrationFileForms, NoiseIsReadOnRequest) {
  const std::string text = std::string(kRos) + "sigma_px: 0.7\n";
  EXPECT_FALSE(ReadText(text).root().At("calibration").Find("sigma_px"));
  const Config config = ReadText(text, {.noise = true});
  EXPECT_EQ(config.root().At("calibration").At("sigma_px").Number(), 0.7);
}

TEST_F(CalibrationFileForms, WhatNoCameraHereDoesIsRefused) {
  ExpectError(Changed(kKalibr, "pinhole", "omni"), "3:17",
              "camera model 'omni' is not supported; expected pinhole");
  ExpectError(Changed(kKalibr, "equidistant", "fov"), "5:21",
              "distortion model 'fov' is not supported; expected radtan, radial-tangential, "
              "equidistant or none");
  ExpectError(Changed(kRos, "plumb_bob", "thin_prism"), "5:19",
              "distortion model 'thin_prism' is not supported; expected plumb_bob, "
              "rational_polynomial or equidistant");
  ExpectError(Changed(kRos, "401", "nan"), "4:", "camera_matrix");
  ExpectError(Changed(kRos, "[400, 0,", "[400, 2,"), "4:41", "a camera with skew is not supported");
  ExpectError("cam: {intrinsics: [1, 2, 3, 4]}\n", "1:1",
              "a file of Kalibr, OpenCV, ROS (camera_info), EuRoC, ORB-SLAM or VINS (camodocal)");
}

}  // namespace
}  // namespace alidade
