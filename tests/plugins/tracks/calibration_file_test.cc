// SPDX-License-Identifier: Apache-2.0
#include "tracks_fixture.h"

namespace alidade {
namespace {

class CalibrationFileForms : public testing::TracksTest {
 protected:
  /// Returns the value that a model reads from a calibration key, or the error.
  std::string Get(const std::string& text, const std::string& key) {
    Write("tracks.csv", "0,1,0,5\n0,1,1,6\n");
    Write("calibration.yaml", text);
    try {
      const auto calibration = Open()->Calibration();
      const auto node = calibration->root().At("calibration").At("camera").Find(key);
      return node ? node->Text() : "none";
    } catch (const Error& error) {
      return error.what();
    }
  }
  double Number(const std::string& text, const std::string& key) {
    return std::stod(Get(text, key));
  }
};

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

TEST_F(CalibrationFileForms, Euroc) {
  EXPECT_EQ(Get(kEuroc, "model"), "radtan");
  EXPECT_EQ(Get(kEuroc, "width"), "752");
  EXPECT_DOUBLE_EQ(Number(kEuroc, "p2"), 1.8e-05);
  EXPECT_DOUBLE_EQ(Number(kEuroc, "k3"), 0.0);
}

TEST_F(CalibrationFileForms, WhatNoCameraHereDoesIsRefused) {
  const auto changed = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const auto expect = [&](const std::string& text, const std::string& what) {
    const std::string error = Get(text, "fx");
    EXPECT_NE(error.find(what), error.npos) << error;
    EXPECT_NE(error.find("calibration.yaml:"), error.npos) << error;
  };
  expect(changed(kKalibr, "pinhole", "omni"), "'omni'");
  expect(changed(kKalibr, "equidistant", "fov"), "'fov'");
  expect(changed(kRos, "401", "nan"), "camera_matrix");
  expect(changed(kRos, "[400, 0,", "[400, 2,"), "without skew");
  expect(changed(kRos, "[0, 0, 0, 0, 0]", "[0, 0, 0, 0, 0, 0.1, 0, 0]"), "after the first 5");
}

}  // namespace
}  // namespace alidade
