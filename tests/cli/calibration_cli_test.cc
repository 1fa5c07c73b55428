// SPDX-License-Identifier: Apache-2.0
//
// Tests data that contain a calibration. A model uses this calibration if the config contains none.
// A config with a different calibration is refused.
#include "support/program.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::Outcome;

const std::string kRemedy =
    "; expected the same value; correct or remove this key, or set 'source.calibration: "
    "ignore'\n";

class CalibrationCli : public testing::ProgramTest {
 protected:
  Outcome Run(const std::string& config, const std::string& setting = "") const {
    std::vector<std::string> arguments = {"run", config, "-o", "out", "--force"};
    if (!setting.empty()) arguments.insert(arguments.end(), {"--set", setting});
    return Call(arguments);
  }
  /// Returns the estimates of a run of `config`, which must succeed.
  std::string Estimates(const std::string& config, const std::string& setting = "") const {
    const Outcome outcome = Run(config, setting);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.code == 0 ? Read("out/ekf/estimates.csv") : "";
  }

  /// Writes a table with `comment` in its first line. The rows are disparities of a target at
  /// 0.3 m; the stereo pair has f B = 26 px m.
  void WriteTable(const std::string& comment) const {
    std::string text = comment + "t_s,d\n";
    for (int k = 0; k < 20; ++k) text += std::to_string(0.1 * k) + ",86.5\n";
    Write("table.csv", text);
  }
  /// Writes a config that reads the table. `keys` are added to the entry of the stereo sensor.
  void WriteConfig(const std::string& keys) const {
    Write("depth.yaml", testing::kTargetConfig +
                            "sensors:\n  stereo: {model: stereo_disparity, stream: disparity, "
                            "sigma_px: 1, roles: {depth: target.depth}" +
                            keys +
                            "}\nsource: {type: tables, path: table.csv, streams: {disparity: d}}\n"
                            "estimators: {ekf: {type: ekf}}\n");
  }

  /// Writes the tracks of four points in three frames. Points and camera are at rest.
  void WriteTracks(const std::string& calibration) const {
    std::string tracks, times = "frame,t_s\n";
    for (int frame = 0; frame < 3; ++frame) {
      times += std::to_string(frame) + ',' + std::to_string(0.1 * frame) + '\n';
      for (int id = 0; id < 4; ++id) {
        const std::string start = std::to_string(frame) + ',' + std::to_string(id);
        tracks += start + ",0," + std::to_string(200 + 60 * id) + '\n';
        tracks += start + ",1," + std::to_string(300 - 40 * id) + '\n';
        tracks += start + ",2," + std::to_string(180 + 60 * id) + '\n';
        tracks += start + ",3," + std::to_string(300 - 40 * id) + '\n';
      }
    }
    fs::create_directories(folder_ / "drive");
    Write("drive/tracks.csv", tracks);
    Write("drive/timestamps.csv", times);
    fs::remove(folder_ / "drive/calibration.yaml");
    if (!calibration.empty()) Write("drive/calibration.yaml", calibration);
  }
  /// Writes a config that reads the tracks. Adds `root` at the root of the config, and `keys` to
  /// the entry of the sensor.
  void WriteSlam(const std::string& root, const std::string& keys) const {
    Write("slam.yaml", R"(alidade: 1
state:
  cam:
    model: quaternion_pose
    noise: {linear_acceleration: 1, angular_acceleration: 1}
    initial:
      position: {mean: [0, 0, 0], sigma: 0.1}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0.1}
      velocity: {mean: [0, 0, 0], sigma: 1}
      angular_velocity: {mean: [0, 0, 0], sigma: 0.1}
landmarks: {representation: anchored}
sensors:
  stereo:
    model: stereo_feature
    stream: tracks
    roles: {position: cam.position, orientation: cam.orientation, landmark: landmarks}
    sigma_px: 1
)" + keys +
                           "source: {type: tracks, path: drive, measures: stereo}\nestimators: "
                           "{ekf: {type: ekf}}\n" +
                           root);
  }
};

constexpr const char* kHeader = "# real; fx_px=400 baseline_m=0.065; points 5 and 7\n";

TEST_F(CalibrationCli, TheHeaderOfATableTellsTheCamera) {
  WriteTable("");
  WriteConfig(", focal_px: 400, baseline_m: 0.065");
  const std::string written = Estimates("depth.yaml");
  WriteTable(kHeader);
  EXPECT_EQ(Estimates("depth.yaml"), written);
  WriteConfig("");
  EXPECT_EQ(Estimates("depth.yaml"), written);
  WriteTable("# focal_px=200, baseline_m=0.13\n");
  EXPECT_EQ(Estimates("depth.yaml"), written);  // f B is the same as before
  WriteTable("");
  EXPECT_TRUE(Contains(Run("depth.yaml").err, "stereo.focal_px: missing"));
}

TEST_F(CalibrationCli, ATableOfAnotherCameraIsRefused) {
  WriteTable(kHeader);
  WriteConfig(", focal_px: 390, baseline_m: 0.065");
  const Outcome other = Run("depth.yaml");
  EXPECT_EQ(other.code, 78);
  EXPECT_TRUE(Contains(other.err,
                       "sensors.stereo.focal_px: 390 differs from the calibration of "
                       "the data, 400 in "))
      << other.err;
  EXPECT_TRUE(Contains(other.err, "table.csv:1:15" + kRemedy)) << other.err;
  // Two focal lengths count as equal up to a relative difference of 1e-6. A difference of 2e-6 is
  // refused.
  EXPECT_EQ(Run("depth.yaml", "sensors.stereo.focal_px=400.0003").code, 0);
  EXPECT_EQ(Run("depth.yaml", "sensors.stereo.focal_px=400.0008").code, 78);
  const std::string ignoring = Estimates("depth.yaml", "source.calibration=ignore");
  WriteTable("");
  EXPECT_EQ(Estimates("depth.yaml"), ignoring);
}

TEST_F(CalibrationCli, AnOverrideOfOneEstimatorIsHeldToTheDataToo) {
  WriteTable(kHeader);
  WriteConfig("");
  const Outcome other =
      Run("depth.yaml", "estimators.ekf.overrides={sensors: {stereo: {baseline_m: 0.066}}}");
  EXPECT_EQ(other.code, 78);
  EXPECT_TRUE(Contains(other.err, "0.066 differs from the calibration of the data, 0.065 in "))
      << other.err;
}

TEST_F(CalibrationCli, WhatAHeaderTellsMustBeANumberOnce) {
  WriteConfig("");
  WriteTable("# fx_px=4OO baseline_m=0.065\n");
  const Outcome text = Run("depth.yaml");
  EXPECT_EQ(text.code, 65);
  EXPECT_TRUE(Contains(text.err, "table.csv:1:9 focal_px: '4OO' ")) << text.err;
  WriteTable(std::string(kHeader) + "# baseline_m=0.1\n");
  const Outcome twice = Run("depth.yaml");
  EXPECT_EQ(twice.code, 65);
  EXPECT_TRUE(Contains(twice.err,
                       "table.csv:2:14 baseline_m: there is a second value; the first value is in "
                       "line 1"))
      << twice.err;
  WriteTable("# fx_px=-4 baseline_m=0.065\n");
  const Outcome negative = Run("depth.yaml");
  EXPECT_TRUE(Contains(negative.err, "table.csv:1:9 calibration.focal_px: '-4'")) << negative.err;
}

constexpr const char* kDrive = R"(# rectified
image: {width: 640, height: 480}
intrinsics_px: {fx: 500, fy: 510, cx: 320, cy: 240}
baseline_m: 0.5
vehicle_from_cam:
  position_m: [1, 0, 1.5]
  quaternion: {w: 0.5, x: -0.5, y: 0.5, z: -0.5}
)";
constexpr const char* kSimulated =
    "camera: {width: 640, height: 480, fx: 500, fy: 510, cx: 320, cy: 240, baseline_m: 0.5}\n";

TEST_F(CalibrationCli, TheFileBesideTracksTellsTheCamera) {
  const std::string camera =
      "camera: {width: 640, height: 480, fx: 500, fy: 510, cx: 320, cy: 240, baseline_m: 0.5}\n";
  WriteTracks("");
  WriteSlam(camera, "");
  const std::string written = Estimates("slam.yaml");
  for (const char* calibration : {kDrive, kSimulated}) {
    WriteTracks(calibration);
    WriteSlam(camera, "");
    EXPECT_EQ(Estimates("slam.yaml"), written) << calibration;
    WriteSlam("", "");
    EXPECT_EQ(Estimates("slam.yaml"), written) << calibration;
  }
}

/// Two cameras in the form of Kalibr. The second is the camera of the tracks.
constexpr const char* kChain = R"(cam0:
  camera_model: pinhole
  intrinsics: [300, 300, 320, 240]
  distortion_model: none
  distortion_coeffs: []
  resolution: [640, 480]
cam1:
  camera_model: pinhole
  intrinsics: [500, 510, 320, 240]
  distortion_model: none
  distortion_coeffs: []
  resolution: [640, 480]
)";

TEST_F(CalibrationCli, ACameraMayNameAFile) {
  const std::string camera =
      "camera: {width: 640, height: 480, fx: 500, fy: 510, cx: 320, cy: 240, baseline_m: 0.5}\n";
  WriteTracks("");
  WriteSlam(camera, "");
  const std::string written = Estimates("slam.yaml");
  fs::create_directories(folder_ / "rig");
  Write("rig/chain.yaml", kChain);
  WriteSlam("camera: {file: rig/chain.yaml, entry: cam1, baseline_m: 0.5}\n", "");
  EXPECT_EQ(Estimates("slam.yaml"), written);
  EXPECT_TRUE(Contains(Read("out/config.resolved.yaml"), "fx: 500"))
      << "the run folder does not depend on the calibration file";
  EXPECT_NE(Estimates("slam.yaml", "camera.entry=cam0"), written);
  EXPECT_EQ(Estimates("slam.yaml",
                      "camera={file: rig/chain.yaml, fx: 500, fy: 510, "
                      "baseline_m: 0.5}"),
            written)
      << "the keys of the config precede those of the file";
  WriteSlam("", "    camera: {file: rig/chain.yaml, entry: cam1, baseline_m: 0.5}\n");
  EXPECT_EQ(Estimates("slam.yaml"), written);
  // A file that an included file names is relative to the included file.
  Write("rig/camera.yaml", "camera: {file: chain.yaml, entry: cam1, baseline_m: 0.5}\n");
  WriteSlam("include: rig/camera.yaml\n", "");
  EXPECT_EQ(Estimates("slam.yaml"), written);
}

TEST_F(CalibrationCli, ACameraFileThatCannotBeUsedIsRefused) {
  WriteTracks("");
  WriteSlam("camera: {file: chain.yaml, baseline_m: 0.5}\n", "");
  const Outcome missing = Run("slam.yaml");
  EXPECT_EQ(missing.code, 66);
  EXPECT_TRUE(Contains(missing.err, "chain.yaml: No such file")) << missing.err;
  std::string omni = kChain;
  Write("chain.yaml", omni.replace(omni.find("pinhole"), 7, "omni"));
  const Outcome other = Run("slam.yaml");
  EXPECT_EQ(other.code, 65);
  EXPECT_TRUE(Contains(other.err,
                       "chain.yaml:2:17 cam0.camera_model: camera model 'omni' is not supported; "
                       "expected pinhole\n"))
      << other.err;
}

TEST_F(CalibrationCli, SimulateReadsACameraFile) {
  Write("chain.yaml", kChain);
  Write("scene.yaml", R"(alidade: 1
camera: {file: chain.yaml}
source:
  type: scene
  max_frames: 3
  points: {box: {min: [-2, -1.5, 3], max: [2, 1.5, 6]}, count: 9}
  trajectory: {look_at: [{position: [-0.5, 0, 0], target: [0, 0, 4]},
                         {position: [0.5, 0, 0], target: [0, 0, 4]}]}
)");
  const Outcome outcome = Call({"simulate", "scene.yaml", "-o", "data"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(Contains(Read("data/calibration.yaml"), "fx: 300")) << Read("data/calibration.yaml");
}

TEST_F(CalibrationCli, ExplainShowsWhatTheDataTell) {
  WriteTracks(kDrive);
  WriteSlam("", "");
  const std::string text = Call({"explain", "slam.yaml"}).out;
  EXPECT_TRUE(Contains(text, "  calibration of the data\n")) << text;
  EXPECT_TRUE(Contains(text, "camera.fx")) << text;
  EXPECT_TRUE(Contains(text, "drive/calibration.yaml:3:21\n")) << text;
  WriteTable("");
  WriteConfig(", focal_px: 400, baseline_m: 0.065");
  EXPECT_FALSE(Contains(Call({"explain", "depth.yaml"}).out, "calibration of the data"));
}

TEST_F(CalibrationCli, TracksOfAnotherCameraAreRefused) {
  for (const auto& [calibration, fx, baseline] :
       {std::tuple(kDrive, "3:21", "4:13"), std::tuple(kSimulated, "1:39", "1:83")}) {
    WriteTracks(calibration);
    WriteSlam("camera: {width: 640, fx: 525}\n", "    camera: {baseline_m: 0.4}\n");
    const Outcome other = Run("slam.yaml");
    EXPECT_EQ(other.code, 78);
    for (const std::string& line :
         {"camera.fx: 525 differs from the calibration of the data, 500 in " +
              (folder_ / "drive/calibration.yaml:").string() + fx + kRemedy.substr(0, 20),
          "sensors.stereo.camera.baseline_m: 0.4 differs from the calibration of the data, 0.5 "
          "in " +
              (folder_ / "drive/calibration.yaml:").string() + baseline + kRemedy}) {
      EXPECT_TRUE(Contains(other.err, line)) << other.err;
    }
    EXPECT_TRUE(
        Contains(Run("slam.yaml", "source.calibration=ignore").err, "camera.height: missing"));
  }
}

TEST_F(CalibrationCli, ACalibrationThatIsNotUnderstoodIsRefused) {
  WriteSlam("", "");
  WriteTracks(std::string(kDrive) + "distortion: [0.1, 0.2]\n");
  const Outcome lens = Run("slam.yaml");
  EXPECT_EQ(lens.code, 65);
  EXPECT_TRUE(Contains(lens.err, "drive/calibration.yaml:8:1 distortion: unknown key")) << lens.err;
  EXPECT_TRUE(Contains(lens.err, "; 'source.calibration: ignore' skips the calibration\n"))
      << lens.err;
  WriteTracks("front: {intrinsics: [500, 510, 320, 240]}\n");
  const Outcome other = Run("slam.yaml");
  EXPECT_EQ(other.code, 65);
  EXPECT_TRUE(Contains(other.err,
                       "the file contains no calibration of a camera; expected 'camera', "
                       "'intrinsics_px', or a file of Kalibr, OpenCV, ROS (camera_info), EuRoC, "
                       "ORB-SLAM or VINS (camodocal)"))
      << other.err;
}

TEST_F(CalibrationCli, ASourceWithoutCalibrationRefusesTheKey) {
  const Outcome outcome = Run("config.yaml", "source.calibration=use");
  EXPECT_EQ(outcome.code, 78);
  EXPECT_TRUE(
      Contains(outcome.err, "source.calibration: this source does not provide a calibration"))
      << outcome.err;
  Write("own.yaml", testing::kDepthConfig + "calibration: {camera: {fx: 5}}\n");
  EXPECT_TRUE(Contains(Run("own.yaml").err, "calibration: a config cannot contain this key"));
}

}  // namespace
}  // namespace alidade
